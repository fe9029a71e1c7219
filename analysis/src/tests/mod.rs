//! Tests against differences of the kinematics and of equilibria, and against published examples.

mod differences;
mod examples;
mod syngrasp;
