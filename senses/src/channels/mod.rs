//! The channels. A new one is a file here and a line in the list; its settings, if it has any, are fields of
//! `palmares_models::hand::sensors`.

mod accelerometer;
mod base;
pub mod cameras;
mod encoders;
mod motors;
pub mod touch;
mod wrist;

use crate::declaration::Channel;
use crate::moment::Moment;
use crate::noise::Noise;
use crate::sensor::{Sensor, Slot};
use palmares_models::hand::Hand;
use serde::{Deserialize, Serialize};

/// From the list of sensors: [`CHANNELS`], and everything that all of them do one after the other.
macro_rules! channels {
    ($($field:ident: $sensor:ty,)*) => {
        /// Every channel, in the order of a row.
        pub static CHANNELS: &[&Channel] = &[$(&<$sensor as Sensor>::CHANNEL),*];

        /// The sensors of a run.
        #[derive(Clone)]
        pub(crate) struct Slots { $($field: Slot<$sensor>,)* }

        /// State of the sensors that changes from tick to tick.
        #[derive(Clone, Serialize, Deserialize)]
        pub(crate) struct States { $($field: Option<<$sensor as Sensor>::State>,)* }

        impl Slots {
            pub(crate) fn new(hand: &Hand, noise: Option<&Noise>, tick_s: f64) -> Self {
                let mut begin = 0;
                Slots { $($field: Slot::new(hand, noise, tick_s, &mut begin),)* }
            }

            pub(crate) fn are_ticked(&self) -> bool {
                false $(|| self.$field.is_ticked())*
            }

            pub(crate) fn tick(&mut self, now: &Moment<'_>, tick: u64, row: &mut [f64]) {
                $(self.$field.tick(now, tick, row);)*
            }

            pub(crate) fn read(&self, now: &Moment<'_>, kept: &[f64], row: &mut [f64]) {
                $(self.$field.read(now, kept, row);)*
            }

            pub(crate) fn ideal(&self, now: &Moment<'_>) -> Vec<f64> {
                let mut readings = Vec::new();
                $(self.$field.add_ideal(now, &mut readings);)*
                readings
            }

            pub(crate) fn states(&self) -> States {
                States { $($field: self.$field.state(),)* }
            }

            pub(crate) fn fit(&self, states: &States) -> bool {
                true $(&& self.$field.fits(states.$field.as_ref()))*
            }

            pub(crate) fn restore(&mut self, states: &States) {
                $(self.$field.restore(states.$field.as_ref());)*
            }
        }
    };
}

channels! {
    base: base::Arm,
    motors: motors::MotorSensors,
    wrist: wrist::Wrist,
    encoders: encoders::Encoders,
    touch: touch::Taxels,
    acceleration: accelerometer::Accelerometer,
}
