//! Random variation of masses, sizes, surfaces, sensors and poses in a run, for training.

use super::action_errors::ActionErrors;
use super::given::Given;
use super::training::{ObjectPoses, Quantity, Ranges};
use crate::seed::Seed;
use palmares_models::object::Object;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::noise::{Noise, Sample};
use std::f64::consts::TAU;
use std::sync::Arc;

/// In what a run differs from those of its task.
#[derive(Clone, Debug)]
pub(crate) struct Variation {
    draws: Draws,
    ranges: Ranges,
    given: Given,
    actions: ActionErrors,
}

impl Variation {
    /// Draws from these ranges what is not given; a function of seed and attempt.
    pub(crate) fn new(seed: Seed, attempt: u64, ranges: Ranges, given: Given, actions: ActionErrors) -> Self {
        Variation { draws: Draws::new(seed, attempt), ranges, given, actions }
    }

    /// Factors of mass, friction and size of the `k`-th object of a scene.
    pub(crate) fn factors(&self, k: usize) -> [f64; 3] {
        let factor = |given: &Option<Vec<f64>>, quantity, range: Option<[f64; 2]>| {
            let given = given.as_ref().and_then(|factors| factors.get(k));
            let drawn = || range.map_or(1.0, |range| self.draws.factor(quantity, k, range));
            given.copied().unwrap_or_else(drawn)
        };
        let Given { mass, friction, size, .. } = &self.given;
        [
            factor(mass, Quantity::Mass, self.ranges.mass),
            factor(friction, Quantity::Friction, self.ranges.friction),
            factor(size, Quantity::Size, self.ranges.size),
        ]
    }

    /// The `k`-th object of a scene, and by how much it is let go elsewhere and turned.
    pub(crate) fn object(&self, k: usize, object: &Arc<Object>) -> (Arc<Object>, Pose) {
        let [mass, friction, size] = self.factors(k);
        let varied = Arc::new(object.varied(mass, friction, size));
        let Some(ObjectPoses { shift_m, tilt_deg }) = self.ranges.object_poses else {
            return (varied, Pose::IDENTITY);
        };
        let mut drawn = self.draws.of(Quantity::ObjectPoses, k);
        let shift = Vec3::new(both_ways(&mut drawn), both_ways(&mut drawn), 0.0) * shift_m;
        let (sin, cos) = libm::sincos(TAU * drawn.unit());
        let tilt = Vec3::new(cos, sin, 0.0) * (drawn.unit() * tilt_deg.to_radians());
        (varied, Pose::from_parts(shift, Rotation::from_scaled_axis(tilt)))
    }

    /// Gravity, m/s², if it is given.
    pub(crate) fn gravity(&self) -> Option<Vec3> {
        self.given.gravity.map(Vec3::from_array)
    }

    /// Factors of the masses of the hand's links, if they are given.
    pub(crate) fn link_mass(&self) -> Option<&[f64]> {
        self.given.link_mass.as_deref()
    }

    /// Factor of the sensors' errors.
    pub(crate) fn sensor_noise(&self) -> f64 {
        let range = self.ranges.sensor_noise;
        range.map_or(1.0, |range| self.draws.factor(Quantity::SensorNoise, 0, range))
    }

    /// Ticks by which the actions of the run arrive late, drawn evenly.
    pub(crate) fn action_delay(&self) -> u32 {
        let [low, high] = self.actions.delay;
        if low == high {
            return low;
        }
        let unit = self.draws.numbers.sensor("action_delay").sample(0).unit();
        low + (unit * f64::from(high - low + 1)) as u32
    }

    /// Standard deviation of the errors of actions, as a part of each number's limit.
    pub(crate) fn action_noise(&self) -> f64 {
        self.actions.noise
    }

    /// Random numbers for the action of a tick.
    pub(crate) fn action_errors(&self, tick: u64) -> Sample {
        self.draws.numbers.sensor("action_noise").sample(tick)
    }

    /// The drawn initial pose of the hand, if it is drawn; `from` is the task's.
    pub(crate) fn hand_pose(&self, from: Pose) -> Option<Pose> {
        let poses = self.ranges.hand_pose?;
        let mut drawn = self.draws.of(Quantity::HandPose, 0);
        let shift = poses.position_m.map(|most| most * both_ways(&mut drawn));
        let axis = Vec3::from_array(drawn.normal3()).normalize_or_zero();
        let turn = Rotation::from_scaled_axis(axis * (drawn.unit() * poses.turn_deg.to_radians()));
        let at = from.translation + Vec3::from_array(shift);
        Some(Pose::from_parts(at, (turn * from.rotation).normalize()))
    }
}

/// In (−1, 1).
fn both_ways(drawn: &mut Sample) -> f64 {
    2.0 * drawn.unit() - 1.0
}

/// Random numbers by seed, attempt, quantity and object, each whatever else was drawn: what one quantity is does not hang
/// on whether another is drawn, too.
#[derive(Clone, Debug)]
struct Draws {
    numbers: Noise,
    attempt: u64,
}

impl Draws {
    /// The draws of a run's seed, independent of its scene and of the noise of its sensors.
    fn new(seed: Seed, attempt: u64) -> Self {
        Draws { numbers: Noise::keyed("palmares training", &seed.0), attempt }
    }

    /// The numbers of the `k`-th object, or of what there is one of.
    fn of(&self, quantity: Quantity, k: usize) -> Sample {
        self.numbers.sensor(quantity.name()).sample((self.attempt << 32) + k as u64)
    }

    /// A factor, drawn evenly in its logarithm.
    fn factor(&self, quantity: Quantity, k: usize, [low, high]: [f64; 2]) -> f64 {
        low * libm::pow(high / low, self.of(quantity, k).unit())
    }
}
