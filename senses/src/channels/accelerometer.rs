//! An accelerometer on a link. It reads the mean over a tick.

use crate::declaration::{Channel, Column, Range, Rows};
use crate::moment::Moment;
use crate::noise::{Noise, SensorNoise};
use crate::sensor::Sensor;
use palmares_models::Vec3;
use palmares_models::hand::{Hand, sensors};
use serde::{Deserialize, Serialize};

/// The sensor, and its errors if the run has noise: a constant one, and the noise of a sample.
#[derive(Clone)]
pub(crate) struct Accelerometer {
    sensor: sensors::Accelerometer,
    link: usize,
    tick_s: f64,
    errors: Option<(Vec3, SensorNoise)>,
}

/// Motion of the link's origin after the last tick, in the world frame.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Motion {
    /// m
    position: Option<Vec3>,
    /// Mean over the last tick, m/s. It needs two ticks.
    velocity: Option<Vec3>,
    /// m/s²; zero until there are two velocities.
    acceleration: Vec3,
}

impl Sensor for Accelerometer {
    const CHANNEL: Channel = Channel {
        name: "acceleration",
        key: "acceleration",
        rows: Rows::If(|hand| hand.sensors.accelerometer.is_some()),
        columns: &[Column::numbers(3, "m/s²").range(Range::Symmetric(range))],
        doc: "Acceleration minus gravity in the frame of the accelerometer's link",
        hands: "hands that declare an accelerometer",
        ..Channel::NUMBERS
    };
    type State = Motion;

    /// Without a state the link is taken to be at rest.
    fn law(now: &Moment<'_>, state: Option<&Self::State>, row: &mut [f64]) {
        let link = now.hand.sensors.accelerometer.as_ref().and_then(|sensor| now.hand.link(&sensor.link));
        let rotation = now.links()[link.unwrap_or_default()].rotation;
        let acceleration = state.map_or(Vec3::ZERO, |state| state.acceleration);
        row.copy_from_slice(&(rotation.inverse() * (acceleration - now.gravity)).to_array());
        clamp(row, range(now.hand));
    }

    fn new(hand: &Hand, noise: Option<&Noise>, tick_s: f64) -> Option<(Self, Self::State)> {
        let sensor = hand.sensors.accelerometer.clone()?;
        let errors = noise.map(|noise| {
            let noise = noise.sensor("accelerometer");
            (Vec3::from_array(noise.sample(0).normal3()) * sensor.bias, noise)
        });
        Some((Accelerometer { link: hand.link(&sensor.link)?, sensor, tick_s, errors }, Motion::default()))
    }

    fn tick(&self, now: &Moment<'_>, tick: u64, state: &mut Self::State, row: &mut [f64]) {
        let pose = now.links()[self.link];
        let here = pose.translation;
        let velocity = state.position.map(|last| (here - last) / self.tick_s);
        let change = velocity.zip(state.velocity).map(|(now, before)| (now - before) / self.tick_s);
        let acceleration = change.unwrap_or(Vec3::ZERO);
        *state = Motion { position: Some(here), velocity, acceleration };
        let mut read = pose.rotation.inverse() * (acceleration - now.gravity);
        if let Some((bias, noise)) = &self.errors {
            read += *bias + Vec3::from_array(noise.sample(tick + 1).normal3()) * self.sensor.noise;
        }
        row.copy_from_slice(&read.to_array());
        clamp(row, self.sensor.range);
    }
}

fn clamp(row: &mut [f64], range: f64) {
    row.iter_mut().for_each(|x| *x = x.clamp(-range, range));
}

/// Largest magnitude along each axis, m/s².
fn range(hand: &Hand) -> f64 {
    hand.sensors.accelerometer.as_ref().map_or(0.0, |sensor| sensor.range)
}
