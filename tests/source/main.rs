//! Tests of the source tree itself: what the compiler does not look at.

mod circles;
mod imports;
mod map;
mod training;
