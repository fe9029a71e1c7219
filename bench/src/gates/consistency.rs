//! Convergence.

use super::{converged, error, report};
use crate::cases::Setup;
use crate::cases::synergy::{close_trace, difference};
use crate::recorder::Recorder;

#[test]
fn free_motion_converges_with_first_order_at_least() {
    let report = report("self_consistency", 2e-3);
    converged(&report);
    assert!(error(&report) >= 0.9, "order {}", error(&report));
}

#[test]
fn free_fingers_close_with_less_than_a_tenth_of_the_error_of_implicit_euler() {
    let trace = |dt_s| {
        let setup = Setup::own(dt_s);
        close_trace(&setup, &mut Recorder::default()).expect("the hand closes")
    };
    let reference = trace(0.0625e-3);
    // Implicit Euler: 1.8e-5, 7.2e-5 and 2.9e-4 rad.
    for (dt, rad) in [(1e-3, 1e-6), (4e-3, 4e-6), (16e-3, 3e-5)] {
        let error = difference(&trace(dt), &reference);
        assert!(error <= rad, "at {dt}: {error:e} rad");
    }
}
