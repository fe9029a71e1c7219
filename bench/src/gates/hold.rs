//! Holding.

use super::{at_most, creeps};

#[test]
fn a_pinch_slips_and_holds_as_coulomb_says() {
    for report in at_most("pinch_hold", &[(1e-3, 1.0), (4e-3, 1.0)]) {
        creeps(&report, 1e-6);
    }
}
