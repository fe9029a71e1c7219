//! Tests of the source tree itself: what the compiler does not look at.

mod circles;
mod doc_examples;
mod imports;
mod map;
mod training;
