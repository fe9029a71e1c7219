//! The equilibrium of a hand under forces, with the poses of its links.

use crate::hand::Posture;
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::statics::constrained::solve_constrained;
use palmares_sim::statics::energy::{PointConstraint, Reaction};
use palmares_sim::statics::prediction::solve_loaded;
use palmares_sim::statics::rest::{Equilibrium, NoPrediction};
use palmares_sim::{Config, Push};

/// A hand at rest.
#[derive(Clone, Debug)]
pub struct Rest {
    /// Coordinates, tensions, and how they were found.
    pub equilibrium: Equilibrium,
    /// Pose of every link in the world, as [`link_poses`].
    pub links: Vec<Pose>,
    /// One for each held point.
    pub reactions: Vec<Reaction>,
}

/// The equilibrium at σ under pushes, with some points held. The hand's weight acts unless the hand cancels it. Points are in the frames
/// of [`link_poses`].
///
/// # Errors
/// There is none, or none was found.
pub fn rest(
    config: &Config,
    hand: &Hand,
    base: Pose,
    sigma: &[f64],
    pushes: &[Push],
    held: &[PointConstraint],
) -> Result<Rest, NoPrediction> {
    let placed = |link: usize, point: Vec3| hand.link_from_own(link).transform_point(point);
    let pushes: Vec<Push> = pushes.iter().map(|p| Push { point: placed(p.link, p.point), ..*p }).collect();
    let held: Vec<PointConstraint> =
        held.iter().map(|h| PointConstraint { point: placed(h.link, h.point), ..*h }).collect();
    let (equilibrium, reactions) = if held.is_empty() {
        (solve_loaded(config, hand, base, sigma, &pushes)?, Vec::new())
    } else {
        let found = solve_constrained(config, hand, base, sigma, &pushes, &held)?;
        (found.equilibrium, found.reactions)
    };
    let links = link_poses(hand, base, &equilibrium.q);
    Ok(Rest { equilibrium, links, reactions })
}

/// Pose of the frame of every link's URDF link in the world. That of the root differs from the base's where `[base]` places this.
pub fn link_poses(hand: &Hand, base: Pose, q: &[f64]) -> Vec<Pose> {
    let mut kin = Kinematics::default();
    kin.update(hand, base, q);
    (0..kin.pose.len()).map(|link| own_frame(hand, &kin, link)).collect()
}

/// The frame of a link's URDF link in the world.
pub(crate) fn own_frame(hand: &Hand, kin: &Kinematics, link: usize) -> Pose {
    let link_from_own = hand.link_from_own(link);
    if link_from_own == Pose::IDENTITY { kin.pose[link] } else { kin.pose[link] * link_from_own }
}

impl Rest {
    /// Its coordinates and tensions.
    pub fn posture(&self) -> Posture<'_> {
        Posture { q: &self.equilibrium.q, tension: &self.equilibrium.tension }
    }
}
