//! A hand in a pile.

use super::at_most;

#[test]
fn nothing_of_a_pile_passes_a_wall_when_the_hand_digs_in_it() {
    for case in ["thirty_objects_and_hand", "dense_heap_and_hand"] {
        at_most(case, &[(1e-3, 0.0), (4e-3, 0.0)]);
    }
}
