//! Impacts at one time.

use super::{STEPS, at_most};

#[test]
fn a_symmetric_break_is_symmetric() {
    // The mirror of the scene is the scene: rounding, which every blow multiplies; the required bound.
    at_most("break_mirror", &STEPS.map(|dt| (dt, 1e-9)));
    at_most("racks_mirror", &STEPS.map(|dt| (dt, 1e-9)));
}

#[test]
fn an_elastic_break_keeps_energy_and_momentum() {
    // Without friction nothing takes or gives either: rounding.
    at_most("break_energy", &STEPS.map(|dt| (dt, 1e-9)));
}

#[test]
fn a_ball_that_meets_several_at_once_leaves_as_reflected() {
    // A rebound from furniture in several points is as good as rigid: some parts in a million are missing.
    at_most("tied_blows", &STEPS.map(|dt| (dt, 1e-5)));
}
