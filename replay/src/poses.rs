//! Which bodies moved since they were last shown.

use palmares_models::hand::Hand;
use palmares_models::{Pose, Rotation};
use palmares_tasks::run::RunSample;
use std::sync::Arc;

/// Poses are shown this often per simulated second.
pub(crate) const RATE: f64 = 30.0;
/// Every body is shown again after so many pictures, for those who look at a part of the file only.
const ALL_AFTER: u64 = 300;
/// A body has moved by as much as can be seen, m and quaternion components.
const SEEN: f64 = 1e-5;

/// What is needed to know where every body is; taken where the world is stepped, so it is a plain copy.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// Ticks since reset.
    pub(crate) tick: u64,
    /// Pose of the hand's base.
    pub(crate) base: Pose,
    /// The hand's coordinates.
    pub(crate) q: Vec<f64>,
    /// Poses of the free objects.
    pub(crate) objects: Vec<Pose>,
    /// What the run would be worth if it ended now.
    pub(crate) score: f64,
    /// What goes on in the hand.
    pub(crate) sample: RunSample,
}

/// Remembers what was shown.
pub(crate) struct Shown {
    hand: Arc<Hand>,
    poses: Vec<Pose>,
    pictures: u64,
}

impl Shown {
    /// Nothing shown yet.
    pub(crate) fn new(hand: Arc<Hand>) -> Self {
        Shown { hand, poses: Vec::new(), pictures: 0 }
    }

    /// Poses of the bodies that have moved, by their place in the list of links, first, and objects. A link's pose is
    /// that in its parent's frame, so that a hand that keeps its shape is one body.
    pub(crate) fn changes(&mut self, picture: &Picture) -> Vec<(usize, Pose)> {
        let everything = self.pictures.is_multiple_of(ALL_AFTER);
        self.pictures += 1;
        let links = self.hand.parent_from_links(&picture.q).skip(1);
        let all = std::iter::once(picture.base).chain(links).chain(picture.objects.iter().copied());
        let mut changes = Vec::new();
        for (k, pose) in all.enumerate() {
            match self.poses.get_mut(k) {
                Some(shown) if everything || moved(shown, &pose) => *shown = pose,
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
    let far = |x: f64, y: f64| (x - y).abs() > SEEN;
    let (p, q) = (a.translation.to_array(), b.translation.to_array());
    p.iter().zip(&q).any(|(x, y)| far(*x, *y))
        || parts(a.rotation).iter().zip(&parts(b.rotation)).any(|(x, y)| far(*x, *y))
}
