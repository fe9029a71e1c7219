//! Dead blows return nothing, wherever they meet: half a percent of the speed, as for a lone object on the floor.

use super::{STEPS, at_most};

#[test]
fn nothing_returns_from_free_bodies() {
    at_most("dead_plate", &STEPS.map(|dt| (dt, 0.5)));
    at_most("dead_rod", &STEPS.map(|dt| (dt, 0.5)));
}

#[test]
fn nothing_returns_from_chains_and_heaps() {
    at_most("dead_chain", &STEPS.map(|dt| (dt, 0.5)));
    at_most("dead_heap", &STEPS.map(|dt| (dt, 0.5)));
}

#[test]
fn nothing_returns_from_a_finger() {
    at_most("dead_hand", &STEPS.map(|dt| (dt, 0.5)));
}
