//! Engines that step our scenes beside ours.

mod kind;
pub mod mujoco;
pub mod rapier;
#[cfg(test)]
mod tests;

pub use kind::EngineKind;
