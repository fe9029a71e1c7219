//! Behaviour of whole steps.

mod bolted;
mod energy;
mod overlap;
mod rebound;
