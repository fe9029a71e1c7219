//! Other engines that step our scenes.

mod adapter;
pub mod drake;
mod kind;
pub mod mujoco;
pub mod option_set;
pub mod rapier;
mod surfaces;
#[cfg(test)]
mod tests;
mod worker;

pub use adapter::{Adapter, Feature, NotPlayed};
pub use kind::{EngineKind, GRASPS};
pub use surfaces::Surfaces;
pub use worker::Recording;
