//! The scene of a drawn grasp.

use super::family::Trial;
use anyhow::Result;
use palmares_bench::cases::grasp_scene::{GraspStart, before};
use palmares_sim::Config;

/// The scene of a drawn grasp.
///
/// # Errors
/// A shape without volume.
pub fn scene(trial: &Trial, step_s: f64) -> Result<GraspStart> {
    // Peers do better without sleeping, and nothing here may sleep but the object before it is touched.
    let config = Config { sleeping: false, ..Config::with_step(step_s) };
    before(&trial.hand.model()?, config, &trial.lie)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trials::family::{Family, HandKind};
    use palmares_bench::cases::grasp::{self, Grasp};
    use palmares_bench::rigs::softhand;
    use palmares_bench::robust::placements;

    #[test]
    fn the_cases_placements_make_the_cases_scenes() {
        for (family, object) in
            [(Family::CaseCylinder, Grasp::cylinder()), (Family::CaseBox, Grasp::cuboid())]
        {
            let trial = &Trial::of(HandKind::SoftHand, family, 7).expect("placements")[6];
            let here = scene(trial, 1e-3).expect("a sound scene");
            let placement = placements::grid()[6];
            let hand = softhand().expect("built in");
            let (_, state, start) =
                grasp::scene(&hand, Config::default(), &object, placement).expect("a sound scene");
            assert!((here.start.translation - start.translation).length() < 1e-12);
            assert!(here.start.rotation.angle_between(start.rotation) < 1e-7);
            let turned = here.state.objects[0].rotation.angle_between(state.objects[0].rotation);
            assert!(turned < 1e-7, "{turned}");
        }
    }

    #[test]
    fn every_object_starts_before_the_palm_and_clear_of_the_hand() {
        for hand in HandKind::ALL {
            for family in Family::DRAWN {
                for trial in Trial::of(hand, family, 3).expect("drawn") {
                    let scene = scene(&trial, 1e-3).expect("a sound scene");
                    // The palm is above the object, no farther than half of a large one and the gap.
                    let above = scene.state.base.translation.z;
                    assert!(above > 0.0 && above < 0.25, "{trial:?}: {above}");
                }
            }
        }
    }
}
