//! Sliding and sticking.

use super::{converged, error, report};

#[test]
fn a_block_on_a_critical_slope_stays_and_on_a_steeper_one_slides() {
    // What glides in the deadband of the correction is a part in ten thousand of friction's pull.
    for dt in [1e-3, 4e-3] {
        let report = report("incline_critical", dt);
        converged(&report);
        assert!(error(&report) <= 0.1, "at {dt}: {} % of mu g", error(&report));
        let creep = report.invariants.slip_mm_s.expect("creep is reported");
        assert!(creep <= 1e-6, "at {dt}: {creep:e} mm/s");
    }
}

#[test]
fn a_sliding_cube_stops_where_coulomb_says() {
    // The last step, in which it stops, is not resolved: a h²/2.
    for (dt, percent) in [(0.25e-3, 0.05), (1e-3, 0.05), (8e-3, 0.2)] {
        let report = report("slide_stop", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {} %", error(&report));
    }
}

#[test]
fn a_box_tips_or_slides_where_statics_says() {
    // The search stops at 0.1 %; two seconds are short for a box a few parts in a thousand beyond balance.
    for dt in [1e-3, 8e-3] {
        let report = report("tip_or_slide", dt);
        converged(&report);
        assert!(error(&report) <= 0.5, "at {dt}: {} %", error(&report));
    }
}

#[test]
fn a_bead_is_pushed_along_a_gap_as_newton_says() {
    for (dt, percent) in [(0.25e-3, 0.1), (1e-3, 0.01), (8e-3, 0.02)] {
        let report = report("bead_between_plates", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {} %", error(&report));
    }
}
