//! What a world may not go beyond: how far, how fast, and how much a step may compute.
//!
//! Computing is counted, not timed, so that every machine stops at the same step. The unit is a multiply-add or what
//! takes as long, about a nanosecond on a present core; what a piece of the step costs is estimated from its sizes.

use serde::{Deserialize, Serialize};

/// The most that a step may compute. The dearest step of a hand that digs in a heap of thirty balls, at 1 ms, took 1.1
/// million, of ten balls half a million. The first step of a tower of 102 planks, all of them in one island, takes more than
/// 20 million, which is 10 ms on the clock: what is legal stays well within.
pub const STEP_WORK: u64 = 100_000_000;

/// Into how many substeps the step of an undamped hand is divided at most.
pub(crate) const MOST_SUBSTEPS: u32 = 1024;

/// Nothing may be farther from the origin, m, nor a joint coordinate larger, m or rad: at this distance contacts are
/// still exact to a nanometre.
pub const FARTHEST: f64 = 1e6;

/// No component of a velocity may be larger, m/s or rad/s.
pub const FASTEST: f64 = 1e5;

/// Finding the distance of two shapes.
pub(crate) const DISTANCE_WORK: u64 = 1_000;

/// Finding the contact points of two shapes.
pub(crate) const MANIFOLD_WORK: u64 = 2_000;

/// A contact point in an iteration, or in an evaluation of the line search.
pub(crate) const POINT_WORK: u64 = 100;

/// A link in a recursion over the hand.
pub(crate) const LINK_WORK: u64 = 300;

/// Why a world cannot go on. It stands still from then on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Fault {
    /// A number of the state is infinite or none.
    #[error("a number of the state is not finite")]
    NotFinite,
    /// Something is too fast or too far away.
    #[error("something is faster than {FASTEST:e} m/s or rad/s, or farther than {FARTHEST:e} m or rad")]
    OutOfBounds,
    /// The matrix of a step is not positive definite, so that the step has no solution.
    #[error("a step has no solution")]
    Unsolvable,
    /// A step needs more computing than it may.
    #[error("a step needs more computing than it may")]
    WorkExhausted,
}

/// What a recursion over the hand's links and its dense matrix of n rows cost.
pub(crate) fn hand_work(links: usize, n: usize) -> u64 {
    LINK_WORK * links as u64 + 4 * (n * n) as u64
}
