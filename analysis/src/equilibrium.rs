//! The equilibrium of a hand under forces, with the poses of its links.

use crate::hand::Posture;
use palmares_models::Pose;
use palmares_models::hand::Hand;
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
    /// Pose of every link in the world.
    pub links: Vec<Pose>,
    /// One for each held point.
    pub reactions: Vec<Reaction>,
}

/// The equilibrium at σ under pushes, with some points held. The hand's weight acts unless the hand cancels it.
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
    let (equilibrium, reactions) = if held.is_empty() {
        (solve_loaded(config, hand, base, sigma, pushes)?, Vec::new())
    } else {
        let found = solve_constrained(config, hand, base, sigma, pushes, held)?;
        (found.equilibrium, found.reactions)
    };
    let links = link_poses(hand, base, &equilibrium.q);
    Ok(Rest { equilibrium, links, reactions })
}

/// Pose of every link in the world.
pub fn link_poses(hand: &Hand, base: Pose, q: &[f64]) -> Vec<Pose> {
    let mut kin = Kinematics::default();
    kin.update(hand, base, q);
    kin.pose
}

impl Rest {
    /// Its coordinates and tensions.
    pub fn posture(&self) -> Posture<'_> {
        Posture { q: &self.equilibrium.q, tension: &self.equilibrium.tension }
    }
}
