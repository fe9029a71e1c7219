//! The single plays of a search.

use super::kept::{At, rounded};
use super::score::{End, Outcome};
use crate::child::{Failure, Task};
use crate::engine::{EngineKind, GRASPS, NotPlayed};
use crate::played::Played;
use crate::scene_id::{self, Asked};
use crate::trials::family::{Family, HandKind, Trial};
use crate::trials::play::{Ending, Fate};
use anyhow::{Context, Result};
use palmares_bench::cases;
use std::collections::BTreeMap;

/// A scene of a search, and how it can be played.
pub(super) struct SearchScene {
    /// Name of a case, or [`GRASPS`].
    pub name: String,
    /// Starts of the case, or drawn grasps.
    plays: Vec<Task>,
    /// Identity of what it asks of an engine.
    pub identity: String,
    /// Engines whose adapters do not play it, and why.
    pub refused: BTreeMap<&'static str, NotPlayed>,
}

impl SearchScene {
    /// A case from its first starts, or so many grasps of each drawn family.
    ///
    /// # Errors
    /// There is no such case.
    pub(super) fn new(name: &str, starts: u32, grasps: usize) -> Result<Self> {
        let name = name.to_owned();
        if name == GRASPS {
            let mut hash = Vec::new();
            let mut plays = Vec::new();
            for family in Family::DRAWN {
                for (index, trial) in Trial::of(HandKind::SoftHand, family, grasps)?.iter().enumerate() {
                    let [hand, family] = [HandKind::SoftHand.name(), family.name()].map(str::to_owned);
                    plays.push(Task::Grasp { hand, family, index, aside_um: 0.0 });
                    hash.push(scene_id::of_trial(trial)?);
                }
            }
            let (identity, refused) = (scene_id::of_all(&hash), BTreeMap::new());
            return Ok(SearchScene { name, plays, identity, refused });
        }
        let case = cases::all()
            .find(|case| case.name == name)
            .with_context(|| format!("there is no case `{name}`"))?;
        let play = |start| Task::Case { name: name.clone(), reference_dt_s: None, start };
        let Asked { identity, refused, .. } = scene_id::of_case(case);
        Ok(SearchScene { plays: (0..starts).map(play).collect(), identity, refused, name })
    }

    /// Its plays at these steps, ms: all starts or grasps of one step, then those of the next.
    pub(super) fn plays(&self, steps_ms: &[f64]) -> Vec<At> {
        let of_step = |step_ms: &f64| {
            let step_us = (1e3 * step_ms).round() as u32;
            (0..self.plays.len()).map(move |number| At { step_us, number })
        };
        steps_ms.iter().flat_map(of_step).collect()
    }
}

/// A play that a search wants.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub scene: &'a SearchScene,
    pub kind: EngineKind,
    /// Step and place among the starts or grasps.
    pub at: At,
    /// CPU time that it has, s.
    pub limit_s: f64,
}

impl Wanted<'_> {
    /// Plays it.
    ///
    /// # Errors
    /// The engine cannot be started.
    pub(super) fn play(&self) -> Result<Outcome> {
        let task = self.scene.plays[self.at.number].clone();
        let (dt_s, limit_s) = (1e-6 * f64::from(self.at.step_us), self.limit_s);
        let failed = |failure: Failure| match failure.unfinished {
            true => (End::Unfinished, None),
            false => (End::Failed, None),
        };
        let (end, overlap_mm) = match &task {
            Task::Case { .. } => {
                task.play::<Played>(self.kind, dt_s, limit_s)?.map_or_else(failed, |it| of_case(&it))
            }
            Task::Grasp { .. } => task.play::<Fate>(self.kind, dt_s, limit_s)?.map_or_else(failed, of_grasp),
        };
        Ok(Outcome { end, overlap_mm: overlap_mm.map(rounded) })
    }
}

fn of_case(played: &Played) -> (End, Option<f64>) {
    let invariants = &played.invariants;
    let deep = invariants.overlap_of_bound.is_some_and(|part| part > 1.0);
    let end = match &played.trouble {
        None => End::Solved,
        Some(_) if invariants.newton_unconverged.is_some_and(|n| n > 0) => End::Failed,
        Some(_) if deep && invariants.held != Some(false) => End::Deep,
        Some(_) => End::Lost,
    };
    (end, invariants.max_penetration_mm)
}

fn of_grasp(fate: Fate) -> (End, Option<f64>) {
    let end = match fate.ending {
        Ending::Kept => End::Solved,
        Ending::Overlapping => End::Deep,
        Ending::NotLifted | Ending::LostHeld | Ending::LostShaken => End::Lost,
        Ending::NotFinished => End::Unfinished,
        Ending::Diverged | Ending::NotPlayed => End::Failed,
    };
    (end, matches!(end, End::Solved | End::Deep).then_some(fate.overlap_mm))
}
