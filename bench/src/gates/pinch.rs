//! The pinch hand, which is data only, holds its object.

use super::{at_most, held};

#[test]
fn a_ball_is_taken_between_two_fingertips_lifted_and_held() {
    for report in at_most("pinch_ball", &[0.25e-3, 1e-3, 4e-3, 8e-3].map(|dt| (dt, 1e-3))) {
        held(&report);
    }
}
