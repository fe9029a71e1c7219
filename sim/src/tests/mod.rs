//! Behaviour of whole steps.

mod bolted;
mod digest;
mod energy;
mod friction;
mod joining;
mod law;
mod overlap;
mod rebound;
