//! Cases that gate: what must hold, at every step length asked for. No timing is asserted here.

use crate::cases::{Setup, run};
use crate::report::Report;

fn report(case: &str, dt_s: f64) -> Report {
    let setup = Setup { dt_s, reference_dt_s: None };
    run(case, "own", &setup).expect("the case runs").0
}

fn error(report: &Report) -> f64 {
    report.error.value.expect("the case has an analytic answer")
}

fn converged(report: &Report) {
    assert_eq!(report.invariants.newton_unconverged, Some(0), "{}", report.case);
}

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

#[test]
fn grasps_hold_at_every_step() {
    for case in ["softhand_cylinder", "softhand_box"] {
        for dt in [0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3] {
            let report = report(case, dt);
            converged(&report);
            let seen = &report.invariants;
            assert_eq!(seen.held, Some(true), "{case} at {dt}");
            let slip = seen.slip_mm_s.expect("grasps report slip");
            assert!(slip <= 1e-3, "{case} at {dt}: {slip} mm/s");
            if dt == 1e-3 {
                let depth = seen.max_penetration_mm.expect("grasps report depth");
                assert!(depth <= 0.5, "{case} at {dt}: {depth} mm");
            }
        }
    }
}

#[test]
fn a_block_on_a_critical_slope_stays_and_on_a_steeper_one_slides() {
    let report = report("incline_critical", 1e-3);
    converged(&report);
    assert!(error(&report) <= 1.0, "{} %", error(&report));
    assert!(report.invariants.slip_mm_s.expect("creep is reported") <= 1e-6);
}

#[test]
fn a_sliding_cube_stops_where_coulomb_says() {
    let report = report("slide_stop", 1e-3);
    converged(&report);
    assert!(error(&report) <= 1.0, "{} %", error(&report));
}

#[test]
fn a_rolling_cylinder_gains_no_energy() {
    let report = report("rolling_cylinder", 1e-3);
    converged(&report);
    let gain = report.invariants.energy_gain_j.expect("the gain is reported");
    // Of its 1.9e-4 J, some 3e-10 J come and go with the contact springs, which store 1.2e-6 J under its weight.
    assert!(gain <= 1e-9, "{gain:e} J");
    assert!(error(&report) <= 0.1, "{} %", error(&report));
}

#[test]
fn no_ball_passes_a_wall() {
    let report = report("softhand_balls", 1e-3);
    converged(&report);
    assert_eq!(error(&report), 0.0);
}

#[test]
fn unknown_names_are_refused_with_the_known_ones() {
    let setup = Setup { dt_s: 1e-3, reference_dt_s: None };
    let message = |case, engine| run(case, engine, &setup).err().expect("refused").to_string();
    assert!(message("softhand_fre", "own").contains("softhand_free"));
    assert!(message("softhand_free", "other").contains("known engines: own"));
}
