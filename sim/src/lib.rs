//! Physics of a world: one compliant hand and rigid objects, in generalized coordinates, implicit and convex.
//!
//! No I/O, no clock, no threads, no randomness. `model` and `state` are separate: everything constant in a
//! run is shared and immutable; everything variable is one [`state::State`] that can be cloned, hashed and
//! restored. Units are SI; a pose is written `a_from_b` and maps coordinates in `b` to coordinates in `a`.

pub mod actuation;
pub mod anchor;
pub mod arm;
pub mod bounds;
mod command;
pub mod config;
pub mod contact;
mod digest;
pub mod dynamics;
pub mod model;
mod outcome;
pub mod placing;
mod snapshot;
pub mod solver;
pub mod state;
pub mod statics;
mod step;
pub mod surface;
pub mod world;

#[cfg(test)]
mod tests;

pub use bounds::Fault;
pub use command::{BaseCommand, Command, Push};
pub use config::Config;
pub use model::{Model, Owner};
pub use outcome::{ContactForce, PhaseTimer, StepOutcome, StepPhase};
pub use snapshot::Snapshot;
pub use state::State;
pub use step::SharedScratch;
pub use world::World;
