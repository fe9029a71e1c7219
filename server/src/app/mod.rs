//! What composes the program: builds every part and hands each what it needs.

mod assemble;
mod serve;
pub(crate) mod state;

pub use serve::serve;
pub(crate) use state::App;
