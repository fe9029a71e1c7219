//! Input of a referee.

use palmares_models::Pose;

/// State of an object, as input of the referee.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectSnapshot {
    /// Centre of mass, m.
    pub position: [f64; 3],
    /// Centre of mass in the frame of the hand's base, m.
    pub in_hand: [f64; 3],
    /// Whether it has come to rest.
    pub at_rest: bool,
    /// World from its own frame.
    pub frame: Pose,
}
