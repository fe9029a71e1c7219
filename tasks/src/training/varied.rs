//! A task as it is in a run that differs.

use super::options::TrainingOptions;
use crate::hand_draw::HandDraw;
use crate::seed::Seed;
use crate::start::start_pose;
use crate::task::{ActionErrors, Finer, Given, HandPoses, ObjectPoses, Ranges, Task, Variation};
use palmares_models::content::ContentHash;

impl Task {
    /// The task as it is in the run of a seed. The drawn numbers are a function of seed, attempt and options alone; its content
    /// hash differs from the task's.
    pub(super) fn varied(&self, seed: Seed, attempt: u64, options: &TrainingOptions) -> Task {
        let TrainingOptions { ranges, count, step_s, given, actions, .. } = options;
        let variation = Variation::new(seed, attempt, ranges.clone(), given.clone(), *actions);
        let mut task = self.clone();
        task.objects.count = *count;
        task.step_s = *step_s;
        if let Some(pose) = variation.hand_pose(start_pose(self)) {
            task.hand.position = pose.translation.to_array();
            task.hand.quat_xyzw = pose.rotation.to_array();
        }
        let finer = (*step_s != self.step_s).then(|| self.with_own_steps(options));
        task.vary(variation, content_hash(self, options), finer);
        task
    }

    /// The task of these options with its own steps.
    fn with_own_steps(&self, options: &TrainingOptions) -> Finer {
        let mut options = options.clone();
        options.step_s = self.step_s;
        let own = options.vary_nothing();
        let content_hash = if own { self.content_hash().to_owned() } else { content_hash(self, &options) };
        Finer { content_hash, step_s: self.step_s }
    }
}

/// A hash of options and task of a varied run: it differs from that of all others, and from the task's own.
fn content_hash(task: &Task, options: &TrainingOptions) -> String {
    let TrainingOptions { ranges, count, hand, step_s, given, actions, .. } = options;
    let Ranges { mass, friction, size, sensor_noise, hand_pose, object_poses, hand: _ } = ranges;
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
    if *step_s != task.step_s {
        hash.text("step");
        hash.float(*step_s);
    }
    if *actions != ActionErrors::default() {
        let ActionErrors { delay: [low, high], noise } = actions;
        hash.text("actions");
        hash.count(*low as usize);
        hash.count(*high as usize);
        hash.float(*noise);
    }
    let Given { mass, friction, size, hand: _, gravity, link_mass } = given;
    if let Some(gravity) = gravity {
        hash.text("gravity");
        hash.floats(gravity);
    }
    for (name, factors) in [("mass", mass), ("friction", friction), ("size", size), ("link_mass", link_mass)]
    {
        if let Some(factors) = factors {
            hash.text(name);
            hash.count(factors.len());
            hash.floats(factors);
        }
    }
    // The drawn hand has a hash of its own.
    match hand {
        HandDraw::Own => {}
        HandDraw::All => hash.text("hand"),
        HandDraw::Named(names) => {
            hash.text("named numbers of the hand");
            hash.list(names, |hash, name| hash.text(name));
        }
        HandDraw::Sample { index, count } => {
            hash.text("sample of the hand");
            hash.count(*index as usize);
            hash.count(*count as usize);
        }
    }
    hash.to_hex()
}
