//! Other engines that step our scenes.

mod adapter;
mod kind;
pub mod mujoco;
pub mod option_set;
pub mod rapier;
#[cfg(test)]
mod tests;

pub use adapter::{Adapter, Feature, NotPlayed};
pub use kind::EngineKind;
