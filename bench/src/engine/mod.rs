//! Engines that can step a scene: ours, and the peers it is compared with.
//!
//! A scene is a model with a start state; every engine mirrors what it simulates into such a state, so
//! that a case is written once and judged by the same code whoever steps it.

mod clock;
mod interface;
mod kind;
pub mod limit;
pub mod mujoco;
mod own;
pub mod rapier;

pub use interface::{Cost, Engine, RIGID};
pub use kind::EngineKind;
