//! Other engines that step our scenes.

mod kind;
pub mod mujoco;
pub mod option_set;
pub mod rapier;
#[cfg(test)]
mod tests;

pub use kind::EngineKind;
