//! A block that rocks from one edge to the other.

use super::at_most;

#[test]
fn a_rocking_block_keeps_what_housner_says_with_any_step() {
    at_most("rocking_block", &[0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3].map(|dt| (dt, 2.5)));
}
