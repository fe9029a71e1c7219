//! What composes the program: builds every part and hands each what it needs.

mod assemble;
mod serve;

pub use serve::serve;
