//! Builds the parts of the server, starts and stops it.

mod assemble;
mod beat;
mod serve;

pub use serve::serve;
