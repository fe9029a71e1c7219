//! Tests of the source tree itself, beyond those of the compiler.

mod circles;
mod conflicts;
mod deployment;
mod doc_examples;
mod features;
mod imports;
mod map;
mod modules;
mod pictures;
mod training;
