//! What is played without each law: cases with a bound, and grasps.

use super::watched::{Seen, WatchedFactory};
use crate::cases::Setup;
use crate::cases::grasp::{Grasp, kept};
use crate::robust::placements;
use crate::sweep::{self, SCENES, Scene};
use anyhow::Result;
use palmares_sim::Laws;

/// Of the placements of [`placements::grid`] every third one is played.
const EVERY: usize = 3;

/// A case with a bound, or a grasp.
#[derive(Clone, Copy, Debug)]
pub(super) enum Subject {
    /// The case of a gate.
    Case(&'static Scene),
    /// The SoftHand's grasp of the cylinder or of the box in a placement, by its index.
    Grasp { of_box: bool, placement: usize },
}

/// The outcome of a subject.
pub(super) struct Outcome {
    /// Distance of its figure to the bound, as a part of it; `None` if the run fails. A grasp that is kept is exact.
    pub of_bound: Option<f64>,
    /// Its steps.
    pub seen: Seen,
}

impl Subject {
    /// All of them.
    pub(super) fn all() -> Vec<Subject> {
        let mut all: Vec<Subject> = SCENES.iter().map(Subject::Case).collect();
        for of_box in [false, true] {
            let placements = (0..placements::grid().len()).step_by(EVERY);
            all.extend(placements.map(|placement| Subject::Grasp { of_box, placement }));
        }
        all
    }

    /// Its name.
    pub(super) fn name(self) -> String {
        match self {
            Subject::Case(scene) => scene.name.to_owned(),
            Subject::Grasp { of_box, placement } => {
                format!("grasp of the {} {placement}", if of_box { "box" } else { "cylinder" })
            }
        }
    }

    /// Whether it is a grasp.
    pub(super) fn is_grasp(self) -> bool {
        matches!(self, Subject::Grasp { .. })
    }

    /// Plays it at a step without some laws.
    ///
    /// # Errors
    /// The case has no bound, or the grasp cannot be started.
    pub(super) fn play(self, dt_s: f64, without: Laws) -> Result<Outcome> {
        let factory = WatchedFactory::new(without);
        let setup = Setup::new(factory, dt_s);
        let of_bound = match self {
            Subject::Case(scene) => sweep::play(scene, &setup)?.of_bound(),
            Subject::Grasp { of_box, placement } => {
                let grasp = if of_box { Grasp::cuboid() } else { Grasp::cylinder() };
                if kept(&setup, &grasp, placements::grid()[placement])? { 0.0 } else { f64::INFINITY }
            }
        };
        Ok(Outcome { of_bound: Some(of_bound).filter(|it| it.is_finite()), seen: factory.seen() })
    }
}
