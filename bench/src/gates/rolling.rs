//! Rolling.

use super::{converged, error, report};

#[test]
fn a_rolling_cylinder_neither_gains_nor_loses_energy() {
    // At a quarter of a millisecond it turns by less than a manifold of flat shapes may be old.
    for dt in [0.25e-3, 1e-3, 8e-3] {
        let report = report("rolling_cylinder", dt);
        converged(&report);
        let gain = report.invariants.energy_gain_j.expect("the gain is reported");
        // Of its 1.9e-4 J, some 3e-10 J come and go with the contact springs, which store 1.2e-6 J under its weight.
        assert!(gain <= 1e-9, "at {dt}: {gain:e} J");
        assert!(error(&report) <= 2e-3, "at {dt}: {} %", error(&report));
    }
}

#[test]
fn a_sphere_on_a_slope_rolls_or_slides_as_it_must() {
    // It rolls on the middle of the overlap, 25 µm nearer than its radius: 0.04 %.
    for dt in [1e-3, 8e-3] {
        let report = report("incline_sphere", dt);
        converged(&report);
        assert!(error(&report) <= 0.03, "at {dt}: {} %", error(&report));
    }
}

#[test]
fn a_ball_thrown_without_spin_slides_until_it_rolls() {
    for dt in [0.25e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3] {
        let report = report("bowling", dt);
        converged(&report);
        assert!(error(&report) <= 0.01, "at {dt}: {} %", error(&report));
    }
}

#[test]
fn a_dragged_box_and_the_balls_on_it_move_as_rigid_bodies_do() {
    // Best published at 1 ms: 5.7e-9.
    for (dt, most) in [(1e-3, 2e-9), (4e-3, 2e-8), (16e-3, 5e-7)] {
        let report = report("rolling_box_balls", dt);
        converged(&report);
        assert!(error(&report) <= most, "at {dt}: {:e} (m/s)^2", error(&report));
    }
}
