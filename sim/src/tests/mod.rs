//! Behaviour of whole steps.

mod bolted;
mod energy;
mod friction;
mod overlap;
mod rebound;
