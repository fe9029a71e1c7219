//! A hand in a pile.

use super::{converged, error, report};

#[test]
fn nothing_of_a_pile_passes_a_wall_when_the_hand_digs_in_it() {
    for case in ["thirty_objects_and_hand", "dense_heap_and_hand"] {
        for dt in [1e-3, 4e-3] {
            let report = report(case, dt);
            converged(&report);
            assert_eq!(error(&report), 0.0, "{case} {dt}");
        }
    }
}
