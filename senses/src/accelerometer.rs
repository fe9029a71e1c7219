//! An accelerometer on a link: acceleration minus gravity, in the link's frame, as the mean over a tick.

use crate::noise::{Noise, SensorNoise};
use palmares_models::hand::{Hand, sensors};
use palmares_models::{Pose, Vec3};

/// Place and velocity of the link's origin after a tick, as far as they are known.
pub(crate) type Motion = Option<(Vec3, Option<Vec3>)>;

/// The sensor and what it remembers.
#[derive(Clone, Debug)]
pub(crate) struct Accelerometer {
    sensor: sensors::Accelerometer,
    link: usize,
    /// Without noise there is no error.
    errors: Option<(Vec3, SensorNoise)>,
    /// Of the tick before.
    pub(crate) last: Motion,
}

impl Accelerometer {
    /// None when the hand has none.
    pub(crate) fn new(hand: &Hand, noise: Option<&Noise>) -> Option<Self> {
        let sensor = hand.sensors.accelerometer.clone()?;
        let errors = noise.map(|noise| {
            let noise = noise.sensor("accelerometer");
            (Vec3::from_array(noise.sample(0).normal3()) * sensor.bias, noise)
        });
        Some(Accelerometer { link: hand.link(&sensor.link)?, sensor, errors, last: None })
    }

    /// A tick has passed, and the link is at `pose`.
    pub(crate) fn tick(&mut self, tick: u64, tick_s: f64, links: &[Pose], gravity: Vec3) -> [f64; 3] {
        let pose = links[self.link];
        let here = pose.translation;
        let velocity = self.last.map(|(last, _)| (here - last) / tick_s);
        let before = self.last.and_then(|(_, velocity)| velocity);
        let acceleration = velocity.zip(before).map_or(Vec3::ZERO, |(now, before)| (now - before) / tick_s);
        self.last = Some((here, velocity));
        let mut felt = pose.rotation.inverse() * (acceleration - gravity);
        if let Some((bias, noise)) = &self.errors {
            felt += *bias + Vec3::from_array(noise.sample(tick + 1).normal3()) * self.sensor.noise;
        }
        felt.to_array().map(|x| x.clamp(-self.sensor.range, self.sensor.range))
    }
}
