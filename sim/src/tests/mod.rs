//! Behaviour of whole steps.

mod bolted;
mod digest;
mod energy;
mod friction;
mod overlap;
mod rebound;
