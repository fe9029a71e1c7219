//! Builds the parts of the server, starts and stops it.

mod assemble;
mod beat;
mod memory;
mod playable;
mod serve;

pub use serve::serve;
