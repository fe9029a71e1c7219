//! Encoders of joints.

use crate::declaration::{Channel, Column, ENCODERS, Rows};
use crate::moment::Moment;
use crate::noise::{Noise, SensorNoise};
use crate::quantise::quantised;
use crate::sensor::Sensor;
use palmares_models::hand::Hand;
use palmares_models::hand::sensors::JointEncoders;

/// The encoders of a hand, and the constant error of each.
#[derive(Clone)]
pub(crate) struct Encoders {
    encoders: JointEncoders,
    bias: Vec<f64>,
    noise: SensorNoise,
}

impl Sensor for Encoders {
    const CHANNEL: Channel = Channel {
        name: "encoders",
        key: "joints",
        rows: Rows::Each(&ENCODERS),
        columns: &[Column::numbers(1, "rad")],
        telemetry: Some("q"),
        doc: "Joint encoders, in the order of `welcome.hands[].encoders`",
        hands: "hands whose joints have encoders: ReFlex, its three proximal joints",
        ..Channel::NUMBERS
    };
    type State = ();

    fn law(now: &Moment<'_>, _: Option<&Self::State>, row: &mut [f64]) {
        for (coordinate, angle) in encoded(now.hand).zip(row) {
            *angle = now.q[coordinate];
        }
    }

    fn new(hand: &Hand, noise: Option<&Noise>, _: f64) -> Option<(Self, Self::State)> {
        let encoders = hand.sensors.joints.clone()?;
        let noise = noise?.sensor("joints");
        let mut drawn = noise.sample(0);
        let bias = encoders.on.iter().map(|_| encoders.bias * drawn.normal()).collect();
        Some((Encoders { encoders, bias, noise }, ()))
    }

    fn tick(&self, now: &Moment<'_>, tick: u64, _: &mut (), row: &mut [f64]) {
        let mut drawn = self.noise.sample(tick + 1);
        Self::law(now, None, row);
        for (angle, bias) in row.iter_mut().zip(&self.bias) {
            let noisy = *angle + bias + self.encoders.noise * drawn.normal();
            *angle = quantised(noisy, self.encoders.resolution);
        }
    }
}

/// The coordinates that have an encoder.
fn encoded(hand: &Hand) -> impl Iterator<Item = usize> {
    let on = hand.sensors.joints.iter().flat_map(|encoders| &encoders.on);
    on.filter_map(|name| hand.coordinate(name))
}
