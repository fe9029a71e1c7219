//! A task whose masses, sizes, surfaces, sensors and poses are others in every run.

use super::draws::Draws;
use super::options::{Options, Quantity};
use crate::seed::Seed;
use crate::task::{HandPoses, ObjectPoses, Ranges, Task};
use palmares_models::content::ContentHash;
use palmares_models::object::Object;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::noise::Sample;
use std::f64::consts::TAU;
use std::sync::Arc;

/// In what a run differs from those of its task.
#[derive(Clone, Debug)]
pub(crate) struct Variation {
    draws: Draws,
    ranges: Ranges,
}

impl Task {
    /// The task as it is in the run of a seed. What is drawn is a function of seed, attempt and options alone; its content
    /// hash tells it from the task.
    pub(super) fn varied(&self, seed: Seed, attempt: u64, options: &Options) -> Task {
        let Options { ranges, count, .. } = options;
        let variation = Variation { draws: Draws::new(seed, attempt), ranges: ranges.clone() };
        let mut task = self.clone();
        task.objects.count = *count;
        if let Some(poses) = &ranges.hand_pose {
            let pose = variation.hand_pose(poses, crate::start::start_pose(self));
            task.hand.position = pose.translation.to_array();
            task.hand.quat_xyzw = pose.rotation.to_array();
        }
        task.vary(variation, content_hash(self, options));
        task
    }
}

/// Tells options and task of a varied run from all others, and from the task's own.
fn content_hash(task: &Task, options: &Options) -> String {
    let Options { ranges, count, .. } = options;
    let Ranges { mass, friction, size, sensor_noise, hand_pose, object_poses } = ranges;
    let mut hash = ContentHash::of("palmares varied task 1");
    hash.text(task.content_hash());
    hash.count(*count);
    for factors in [mass, friction, size, sensor_noise] {
        hash.flag(factors.is_some());
        hash.floats(&factors.unwrap_or_default());
    }
    hash.flag(hand_pose.is_some());
    if let Some(HandPoses { position_m, turn_deg }) = hand_pose {
        hash.floats(position_m);
        hash.float(*turn_deg);
    }
    hash.flag(object_poses.is_some());
    if let Some(ObjectPoses { shift_m, tilt_deg }) = object_poses {
        hash.floats(&[*shift_m, *tilt_deg]);
    }
    hash.to_hex()
}

impl Variation {
    /// The `k`-th object of a scene, and by how much it is let go elsewhere and turned.
    pub(crate) fn object(&self, k: usize, object: &Arc<Object>) -> (Arc<Object>, Pose) {
        let factor = |quantity, range: Option<[f64; 2]>| {
            range.map_or(1.0, |range| self.draws.factor(quantity, k, range))
        };
        let (mass, friction, size) = (
            factor(Quantity::Mass, self.ranges.mass),
            factor(Quantity::Friction, self.ranges.friction),
            factor(Quantity::Size, self.ranges.size),
        );
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

    /// Factor of the sensors' errors.
    pub(crate) fn sensor_noise(&self) -> f64 {
        let range = self.ranges.sensor_noise;
        range.map_or(1.0, |range| self.draws.factor(Quantity::SensorNoise, 0, range))
    }

    fn hand_pose(&self, poses: &HandPoses, from: Pose) -> Pose {
        let mut drawn = self.draws.of(Quantity::HandPose, 0);
        let shift = poses.position_m.map(|most| most * both_ways(&mut drawn));
        let axis = Vec3::from_array(drawn.normal3()).normalize_or_zero();
        let turn = Rotation::from_scaled_axis(axis * (drawn.unit() * poses.turn_deg.to_radians()));
        Pose::from_parts(from.translation + Vec3::from_array(shift), (turn * from.rotation).normalize())
    }
}

/// In (−1, 1).
fn both_ways(drawn: &mut Sample) -> f64 {
    2.0 * drawn.unit() - 1.0
}
