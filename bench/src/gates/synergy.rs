//! Closed forms of adaptive synergies.

use super::{converged, error, report};

#[test]
fn free_closure_is_the_closed_form_at_every_step() {
    for dt in [0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3] {
        let report = report("syn_free_close", dt);
        converged(&report);
        assert!(error(&report) <= 1e-9, "dt {dt}: {:e} rad", error(&report));
    }
}

#[test]
fn a_pushed_finger_is_the_closed_form_with_the_motor_locked() {
    for dt in [0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3] {
        let report = report("syn_push_locked_motor", dt);
        converged(&report);
        assert!(error(&report) <= 1e-9, "dt {dt}: {:e} rad", error(&report));
    }
}
