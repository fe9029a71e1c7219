//! Random scenes.

use crate::robust::{SEED, grasps, heaps};

/// A thousand heaps of 3 to 12 objects fall into a box and are kicked, half a second each.
#[test]
fn a_thousand_random_heaps_stay_in_their_box_and_gain_no_energy() {
    let worst = heaps::check(SEED, 1000, 2e-3, 0.5).expect("every heap holds");
    eprintln!("seed {SEED}: {worst:?}");
}

/// Three seconds each; `palmares-bench robust --grasps 1000` plays a thousand.
#[test]
fn a_hundred_random_grasps_bear_being_disturbed() {
    let tally = grasps::check(SEED, 100).expect("every grasp holds");
    eprintln!("seed {SEED}: {tally:?}");
    assert!(tally.grasped > 30 && tally.kept > 0, "the hand does grasp: {tally:?}");
}
