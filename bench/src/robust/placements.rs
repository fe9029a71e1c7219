//! A grid of placements of the object in the hand, and those that keep the grasps of the cases.

use crate::cases::Setup;
use crate::cases::grasp::{Grasp, Placement, kept};
use anyhow::Result;

/// Steps at which a placement must keep both objects, s.
pub const STEPS_S: [f64; 6] = [8e-3, 4e-3, 2e-3, 1e-3, 0.5e-3, 0.25e-3];

/// Every placement of the grid.
pub fn grid() -> Vec<Placement> {
    let mut all = Vec::new();
    for along_m in [0.145, 0.15, 0.155, 0.16, 0.165, 0.17] {
        for across_m in [-0.025, -0.015, -0.005, 0.005] {
            for sigma in [0.6, 0.7, 0.8, 1.0] {
                all.push(Placement { along_m, across_m, sigma });
            }
        }
    }
    all
}

/// Whether a placement keeps cylinder and box, at each of `STEPS_S` in their order.
pub fn outcomes(placement: Placement, first_failure_only: bool) -> Result<Vec<[bool; 2]>> {
    let mut all = Vec::new();
    for dt_s in STEPS_S {
        let setup = Setup::own(dt_s);
        let mut held = [false; 2];
        for (held, grasp) in held.iter_mut().zip([Grasp::cylinder(), Grasp::cuboid()]) {
            *held = kept(&setup, &grasp, placement)?;
        }
        all.push(held);
        if first_failure_only && held != [true; 2] {
            break;
        }
    }
    Ok(all)
}
