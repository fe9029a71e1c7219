//! What does not meet does not act.

use super::{STEPS, at_most};

#[test]
fn a_sleeve_falls_freely_round_a_column_that_it_does_not_touch() {
    // Free fall; a millionth is a contact force that the solver's tolerance may leave.
    let mut bounds = STEPS.map(|dt| (dt, 1e-6)).to_vec();
    // At these, walls bore nothing in the first solution, and held the sleeve once the others were left out.
    bounds.extend([0.004704735811059631, 0.012451010728656889].map(|dt| (dt, 1e-6)));
    at_most("passing_sleeve", &bounds);
}

#[test]
fn what_falls_past_an_edge_falls_freely() {
    at_most("passing_edge", &STEPS.map(|dt| (dt, 1e-6)));
}
