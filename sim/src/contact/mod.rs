//! Contact detection: broad phase, narrow phase by parry, and impacts.

pub mod advancement;
pub mod bodies;
pub mod broad_phase;
pub(crate) mod collide;
pub mod distance_cache;
pub(crate) mod gap;
pub mod impact_candidate;
pub mod impact_sequence;
pub(crate) mod join;
mod joint_impact;
pub mod left_out;
pub mod manifold;
pub(crate) mod motion;
pub mod narrow_phase;
pub(crate) mod pair_points;
pub(crate) mod reach;
pub mod restitution;
