//! Dead blows return nothing, wherever they meet: half a percent of the speed, as for a lone object on the floor.

use super::at_most;

const STEPS: [f64; 5] = [0.25e-3, 1e-3, 4e-3, 8e-3, 16e-3];

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
