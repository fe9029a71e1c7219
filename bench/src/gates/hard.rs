//! Nothing explodes.

use super::{at_most, claims, converged, error, gains, held, report, within};
use crate::case_report::CaseReport;
use crate::cases::{Setup, run};

/// Runs a case at short and long steps: every step converges, all numbers are finite, no energy appears and
/// no body becomes faster than the forces and heights of the scene allow.
fn sound(case: &str, from_nowhere_j: f64) -> Vec<CaseReport> {
    let steps = [0.25e-3, 0.5e-3, 1e-3, 4e-3, 16e-3];
    claims(case, steps);
    steps
        .into_iter()
        .map(|dt| {
            let report = report(case, dt);
            converged(&report);
            within(&report);
            gains(&report, from_nowhere_j);
            report
        })
        .collect()
}

#[test]
fn light_fingers_meet_a_heavy_object() {
    sound("hard_heavy_object", 1e-6);
    sound("hard_pressed_fingers", 1e-6);
}

#[test]
fn any_cable_holds() {
    for report in sound("hard_tendons", 1e-6) {
        held(&report);
    }
}

#[test]
fn stiff_springs_are_no_trouble() {
    sound("hard_springs", 1e-6);
}

#[test]
fn a_hand_pressed_against_floor_and_wall_stays_outside() {
    for report in sound("hard_pressed_base", 1e-6) {
        held(&report);
    }
}

#[test]
fn overlapping_bodies_separate() {
    for report in sound("hard_overlap", 0.5) {
        held(&report);
    }
}

#[test]
fn commands_may_jump() {
    sound("hard_teleport", 1e-6);
    sound("hard_flip", 1e-6);
}

#[test]
fn a_fast_spinning_capsule_does_not_explode() {
    // It hops, slides and spins at 100 rad/s, and takes some percent of its energy from nowhere; see
    // docs/physics.md. Rotation stepped to the first order took a thousand times its whole energy.
    at_most("hard_spin", &[0.25e-3, 1e-3, 4e-3, 16e-3].map(|dt| (dt, 10.0)));
}

#[test]
fn grasps_are_stable_at_sixteen_milliseconds() {
    for case in ["softhand_cylinder", "softhand_box"] {
        converged(&report(case, 16e-3));
    }
}

#[test]
#[ignore = "a known error of docs/physics.md: the object takes one of two courses"]
fn no_step_near_two_milliseconds_throws_the_heavy_object() {
    // Over this range of steps and starts it moves at 0.23 to 0.28 m/s; twice that is another course.
    for dt in [1.5e-3, 1.9e-3, 2e-3, 2.1e-3, 2.5e-3] {
        for start in [0, 3] {
            let setup = Setup { start, ..Setup::own(dt) };
            let found = error(&run("hard_heavy_object", &setup).expect("the case runs").0);
            assert!(found <= 0.5, "at {dt} from start {start}: {found} m/s");
        }
    }
}
