//! What a referee sees.

use palmares_models::Pose;

/// Slower than this an object counts as at rest, m/s; carried objects move with the hand.
pub(crate) const REST_SPEED: f64 = 5e-3;

/// What the referee is shown of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectSnapshot {
    /// Centre of mass, m.
    pub position: [f64; 3],
    /// The same in the frame of the hand's base, m.
    pub in_hand: [f64; 3],
    /// Whether it has come to rest.
    pub at_rest: bool,
    /// World from its own frame.
    pub frame: Pose,
}
