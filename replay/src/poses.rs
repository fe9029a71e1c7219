//! The poses of a run, and which of them changed since they were last written.

use palmares_models::hand::Hand;
use palmares_models::{Pose, Rotation};
use palmares_tasks::run::RunSample;
use std::sync::Arc;

/// Pose frames per simulated second.
pub(crate) const RATE: f64 = 30.0;
/// Period, in frames, after which all poses are written again: readers may start in the middle of a file.
const KEY_FRAME_PERIOD: u64 = 300;
/// Smallest visible change: m, and quaternion components.
const MIN_CHANGE: f64 = 1e-5;

/// Everything that the poses of all bodies follow from. The thread of the world makes it, so it is a plain copy.
#[derive(Clone, Debug)]
pub(crate) struct PoseFrame {
    /// Ticks since reset.
    pub(crate) tick: u64,
    /// Pose of the hand's base.
    pub(crate) base: Pose,
    /// The hand's coordinates.
    pub(crate) q: Vec<f64>,
    /// Poses of the free objects.
    pub(crate) objects: Vec<Pose>,
    /// Score if the run ended now.
    pub(crate) score: f64,
    /// Sample of the hand.
    pub(crate) sample: RunSample,
}

/// Selects the poses that changed since they were last written.
pub(crate) struct ChangedPoses {
    hand: Arc<Hand>,
    poses: Vec<Pose>,
    frames: u64,
}

impl ChangedPoses {
    /// No pose is written yet.
    pub(crate) fn new(hand: Arc<Hand>) -> Self {
        ChangedPoses { hand, poses: Vec::new(), frames: 0 }
    }

    /// The poses that changed, each with the index of its body: links first, then objects. A link's pose is in its
    /// parent's frame: of a hand that keeps its shape, only the base changes.
    pub(crate) fn changes(&mut self, frame: &PoseFrame) -> Vec<(usize, Pose)> {
        let key_frame = self.frames.is_multiple_of(KEY_FRAME_PERIOD);
        self.frames += 1;
        let links = self.hand.parent_from_links(&frame.q).skip(1);
        let all = std::iter::once(frame.base).chain(links).chain(frame.objects.iter().copied());
        let mut changes = Vec::new();
        for (k, pose) in all.enumerate() {
            match self.poses.get_mut(k) {
                Some(shown) if key_frame || moved(shown, &pose) => *shown = pose,
                Some(_) => continue,
                None => self.poses.push(pose),
            }
            changes.push((k, pose));
        }
        changes
    }
}

fn moved(a: &Pose, b: &Pose) -> bool {
    let parts = |q: Rotation| [q.x, q.y, q.z, q.w];
    let far = |x: f64, y: f64| (x - y).abs() > MIN_CHANGE;
    let (p, q) = (a.translation.to_array(), b.translation.to_array());
    p.iter().zip(&q).any(|(x, y)| far(*x, *y))
        || parts(a.rotation).iter().zip(&parts(b.rotation)).any(|(x, y)| far(*x, *y))
}
