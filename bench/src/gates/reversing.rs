//! Motors that reverse at once.

use super::{STEPS, at_most, claims, converged, report, within};

#[test]
fn a_carriage_follows_its_reversals() {
    claims("sudden_reversals", STEPS);
    for dt in STEPS {
        let report = report("sudden_reversals", dt);
        converged(&report);
        within(&report);
    }
}

#[test]
fn a_chain_whose_motor_reverses_stays_closed() {
    // 5 N·m at 30 mm stretch a pin of 1e7 N/m by 17 um, and a step of 16 ms at 1.2 rad/s leaves its tangent by 6 um.
    at_most("closed_chain", &STEPS.map(|dt| (dt, 0.025)));
}
