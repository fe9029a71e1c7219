//! The ReFlex rests at the equilibrium of R(q) and holds what it closes on.

use super::{at_most, held};
use crate::cases::Setup;
use crate::cases::reflex::{Placement, play};
use crate::recorder::Recorder;

const STEPS_S: [f64; 6] = [0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3];

#[test]
fn free_closure_is_the_exact_equilibrium_at_every_step() {
    at_most("reflex_free", &STEPS_S.map(|dt| (dt, 1e-9)));
}

#[test]
fn a_ball_is_held_without_creep_at_every_step() {
    for report in at_most("reflex_ball", &STEPS_S.map(|dt| (dt, 1e-3))) {
        held(&report);
        let (invariants, dt) = (&report.invariants, report.dt_s);
        let residual = invariants.static_residual_nm.expect("our own world reports it");
        assert!(residual <= 1e-5, "dt {dt}: {residual:e} N m");
        let balance = invariants.tension_balance_nm.expect("our own world reports it");
        assert!(balance <= 1e-6, "dt {dt}: {balance:e} N m");
        let depth = invariants.max_penetration_mm.expect("grasps report depth");
        assert!(dt > 1e-3 || depth <= 0.5, "dt {dt}: {depth} mm");
    }
}

/// The grasp also holds in other placements.
#[test]
fn the_ball_is_held_wherever_it_lies_between_the_fingers() {
    let setup = Setup::own(4e-3);
    for x_m in [0.0, 0.03] {
        for z_m in [0.145, 0.155] {
            for preshape in [0.0, 0.25, 0.5, 0.75, 1.0] {
                for sigma in [0.75, 1.0] {
                    let placement = Placement { x_m, z_m, preshape, sigma };
                    let invariants = play(&setup, placement, &mut Recorder::default()).expect("it runs");
                    assert_eq!(invariants.held, Some(true), "{placement:?}");
                    assert_eq!(invariants.newton_unconverged, Some(0), "{placement:?}");
                }
            }
        }
    }
}
