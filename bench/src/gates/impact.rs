//! Rebounds.

use super::{at_most, gains};

#[test]
fn elastic_balls_keep_their_energy() {
    // (0.55 J)² of 24,034.5 J, lost in the bounces of a contact's first step; the best published figure at 1 ms is 185.
    for report in at_most("bounce_elastic", &[0.25e-3, 1e-3, 8e-3, 16e-3].map(|dt| (dt, 0.5))) {
        gains(&report, 1e-6);
    }
}

#[test]
fn a_ball_bounces_ever_lower_and_comes_to_rest_in_time() {
    // Below 5 cm/s contacts are springs again: they lose a bounce or two of the last 0.05 s of 4.06 s. At 16 ms the last
    // bounces are shorter than a step.
    at_most("bounce_zeno", &[(0.0625e-3, 1.0), (0.25e-3, 1.0), (1e-3, 1.0), (4e-3, 1.0), (16e-3, 5.0)]);
}

#[test]
fn equal_elastic_balls_hand_their_speed_on_to_the_last() {
    for case in ["newton_cradle", "newton_cradle_touching"] {
        // A rebound is as good as rigid: a part in a million is missing.
        let bounds = [0.0625e-3, 0.125e-3, 0.5e-3, 1e-3, 4e-3, 16e-3].map(|dt| (dt, 1e-3));
        for report in at_most(case, &bounds) {
            gains(&report, 1e-9);
        }
    }
}

#[test]
fn a_ball_that_slips_rebounds_by_coulombs_law() {
    at_most("sliding_impact", &[0.25e-3, 1e-3, 8e-3, 16e-3].map(|dt| (dt, 1.0)));
}

#[test]
fn what_does_not_rebound_returns_nothing() {
    at_most("dead_impact", &[0.25e-3, 1e-3, 8e-3, 16e-3].map(|dt| (dt, 0.5)));
}
