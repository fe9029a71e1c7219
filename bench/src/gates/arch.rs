//! An arch of loose stones.

use super::{STEPS, at_most};

#[test]
fn a_thick_arch_stands_and_a_thin_one_falls() {
    // A joint turns by at most W/(2 k t) under the weight W = 304 N of the arch on one edge, 1.5e-6 rad, and the keystone follows
    // eleven joints over a radius: 8 um; anchors yield as much again.
    at_most("arch", &STEPS.map(|dt| (dt, 0.02)));
}
