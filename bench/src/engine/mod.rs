//! The interface between a case and an engine, and ours. The crate `palmares-compare` has others.
//!
//! A scene is a model with a start state. Every engine mirrors its simulation into such a state, so that a case is
//! written once and the same code judges every engine.

pub mod clock;
mod interface;
pub mod limit;
mod own;

pub use interface::{Cost, Engine, EngineFactory, RIGID};
pub use own::OwnFactory;
