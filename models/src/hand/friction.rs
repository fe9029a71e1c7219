//! Where a hand rubs.

use super::{Guide, Hand, Tendon};

/// Smaller dry friction of a joint, N·m or N, is none.
const LEAST: f64 = 1e-12;

impl Tendon {
    /// The guides on which it rubs, each with the guides from it outwards.
    pub fn rubbing(&self) -> impl Iterator<Item = (&Guide, &[Guide])> {
        let rubs = |entry: &(usize, &Guide)| entry.1.exponent() > 0.0;
        self.guides.iter().enumerate().filter(rubs).map(|(k, guide)| (guide, &self.guides[k..]))
    }
}

impl Hand {
    /// The joints with dry friction, and its largest torque, N·m (force, N).
    pub fn dry_joints(&self) -> impl Iterator<Item = (usize, f64)> {
        let all = self.coordinates.iter().map(|c| c.friction).enumerate();
        all.filter(|(_, friction)| *friction > LEAST)
    }

    /// Number of places where it rubs: guides by tendon from the motor outwards, then joints.
    pub fn friction_places(&self) -> usize {
        self.tendons.iter().map(|tendon| tendon.rubbing().count()).sum::<usize>() + self.dry_joints().count()
    }
}
