//! Physics of a world: one compliant hand and rigid objects, in generalized coordinates, implicit and convex.
//!
//! No I/O, no clock, no threads, no randomness. `model` and `state` are separate: everything constant in a
//! run is shared and immutable; everything variable is one [`state::State`] that can be cloned, hashed and
//! restored. Units are SI; a pose is written `a_from_b` and maps coordinates in `b` to coordinates in `a`.
//!
//! | part | content |
//! |---|---|
//! | `sim/src/world.rs`, `model.rs`, `state.rs` | the model, the state, and the scratch memory of a step |
//! | `sim/src/step/` | one step: `mod.rs` is its table of contents, every other file one phase or one integrator |
//! | `sim/src/surface/` | faces of shapes, seams between parts, torsional friction of round and soft contacts (`spin.rs`) |
//! | `sim/src/contact/` | `collide.rs`: touching shapes; `manifold/`: contact points; `advancement.rs`: fast objects; `restitution.rs`: rebounds |
//! | `sim/src/anchor.rs` | friction at rest |
//! | `sim/src/law.rs`, `tally.rs` | laws that a study can leave out; parts of a scene, and laws that act in it |
//! | `sim/src/solver/` | the convex problem of a step: friction cone, tendons and limits, Newton's method, Cholesky |
//! | `sim/src/dynamics/` | kinematics, mass matrix and bias of the hand |
//! | `sim/src/actuation/` | base, motors, tendons and their clutches; `elastic.rs`: springs across joints, pins of closed chains; `friction.rs`: dry friction of cables and joints |
//! | `sim/src/arm/` | inverse kinematics of an arm that carries the hand, and how far its joints come in a time |
//! | `sim/src/statics/` | equilibrium of a hand without a step: `equilibrium.rs` in closed form and by Newton's method, `prediction.rs` at limits and under pushes, `constrained.rs` with fixed points, `band.rs` the limits of a hand that rubs |

pub mod actuation;
pub mod anchor;
pub mod arm;
pub mod bounds;
mod command;
pub mod config;
pub mod contact;
mod digest;
pub mod dynamics;
mod law;
pub mod model;
mod outcome;
pub mod placing;
mod snapshot;
pub mod solver;
pub mod state;
pub mod statics;
mod step;
pub mod surface;
mod tally;
pub mod world;

#[cfg(test)]
mod tests;

pub use bounds::Fault;
pub use command::{BaseCommand, Command, Push};
pub use config::Config;
pub use law::{Law, Laws};
pub use model::{Model, Owner};
pub use outcome::{ContactForce, PhaseTimer, StepOutcome, StepPhase};
pub use snapshot::Snapshot;
pub use state::State;
pub use step::SharedScratch;
pub use tally::{Parts, Tally};
pub use world::World;
