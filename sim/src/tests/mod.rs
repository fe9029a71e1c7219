//! Behaviour of whole steps.

mod energy;
mod overlap;
mod rebound;
