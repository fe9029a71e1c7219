//! No blow adds energy, and none forgets its rebound.

use super::{STEPS, at_most};
use crate::cases::Setup;
use crate::cases::blows::{any_body, throws};
use crate::recorder::Recorder;

#[test]
fn no_throw_of_a_box_gains_energy() {
    // Passive bodies: a billionth of the energy is what rounding may leave.
    at_most("blows_box", &STEPS.map(|dt| (dt, 1e-9)));
}

#[test]
fn no_throw_of_any_body_gains_energy() {
    at_most("blows_gain", &STEPS.map(|dt| (dt, 1e-9)));
}

/// Twenty thousand at each of five steps.
#[test]
#[ignore = "some minutes"]
fn a_hundred_thousand_throws_gain_no_energy() {
    for dt in STEPS {
        let gains = throws(&Setup::own(dt), &mut Recorder::default(), 0..20_000, any_body)
            .expect("every throw can be played");
        assert_eq!(gains.gaining, 0, "at {dt}: {gains:?}");
    }
}

#[test]
fn a_blow_that_glances_rebounds_as_a_straight_one() {
    // Newton's law of impact, to a hundredth.
    at_most("glancing", &STEPS.map(|dt| (dt, 1.0)));
    at_most("glancing_weight", &STEPS.map(|dt| (dt, 1.0)));
}
