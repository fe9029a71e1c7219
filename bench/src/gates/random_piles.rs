//! Random heaps.

use crate::random_piles::check;

/// A thousand heaps of 3 to 12 objects fall into a box and are kicked, half a second each.
#[test]
fn a_thousand_random_heaps_stay_in_their_box_and_gain_no_energy() {
    let worst = check(1000, 2e-3, 0.5).expect("every heap holds");
    eprintln!("{worst:?}");
}
