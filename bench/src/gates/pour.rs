//! Many bodies poured into a box.

use crate::cases::{Setup, pour};
use crate::recorder::Recorder;

/// Half a second at the middle one of the usual steps. In its second half, a step computes more than the
/// limit of a world of a hundred. `palmares-bench case poured_500` plays the whole case.
#[test]
fn five_hundred_bodies_are_poured_without_a_fault() {
    let setup = Setup::own(4e-3);
    let mut recorder = Recorder::default();
    let finding = pour::poured(&setup, &mut recorder, 500, 0.5).expect("no step has a fault");
    assert_eq!(finding.invariants.newton_unconverged, Some(0));
    assert_eq!(finding.error.value, Some(0.0), "a body is beyond a wall");
}
