//! The SoftHand is as strong as the published one, and its motor no stronger than the real one's.

use super::{at_most, converged, within};
use crate::cases::{Setup, run};
use palmares_models::hand::Hand;

/// The mean over placements is within 20 % of the published force, and within half of the published
/// torque. Two of nine placements may push the object out: the paper's person would have laid it in again.
#[test]
fn both_hands_have_the_published_strength() {
    for name in ["softhand", "softhand_strong"] {
        let hand = Hand::builtin(name).expect("built in");
        let hand: &'static _ = Box::leak(Box::new(hand));
        for case in ["softhand_split_cylinder", "softhand_disc_torque"] {
            let setup = Setup { hand: Some(hand), ..Setup::own(2e-3) };
            let (report, _) = run(case, &setup).expect("the case runs");
            converged(&report);
            within(&report);
            let measured = &report.measured[0];
            assert!(measured.placements.len() >= 5 && measured.lost() <= 2, "{case} of {name}: {measured}");
        }
    }
}

/// The motor has 6 W.
#[test]
fn closing_in_air_takes_no_more_than_the_motor_has() {
    at_most("softhand_closing", &[0.25e-3, 1e-3, 4e-3, 16e-3].map(|dt| (dt, 6.0)));
}
