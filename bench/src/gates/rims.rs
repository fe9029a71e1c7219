//! Rims.

use super::{STEPS, at_most};

#[test]
fn discs_on_their_rims_keep_their_energy() {
    // Rolling costs nothing, sliding without friction neither; the required bound of a coin.
    at_most("rim_kinds", &STEPS.map(|dt| (dt, 0.5)));
}

#[test]
fn a_coin_on_its_rim_takes_its_course() {
    // It goes round and nutates by 14 degrees seven times a second; of this one may be lost, a fourteenth.
    at_most("rim_course", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn a_rim_bears_on_its_lowest_point() {
    // Rounding alone.
    at_most("rim_place", &STEPS.map(|dt| (dt, 1e-6)));
}
