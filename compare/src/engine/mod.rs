//! Other engines that step our scenes.

mod kind;
pub mod mujoco;
pub mod rapier;
#[cfg(test)]
mod tests;

pub use kind::EngineKind;
