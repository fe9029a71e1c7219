//! A row of the tables: an engine with a family and a hand.

use super::cell::Cell;
use super::run::Run;
use super::runner::{Outcomes, Plan};
use super::tally::Flips;
use crate::engine::EngineKind;
use crate::scene_id;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Outcomes of an engine with a family and a hand.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct OutcomeRow {
    /// The hand.
    pub hand: String,
    /// The family.
    pub family: String,
    /// The engine.
    pub engine: String,
    /// Its settings.
    pub settings: String,
    /// At each step.
    pub cells: Vec<Cell>,
    /// Changes of the outcome with the step.
    pub flips: Flips,
    /// Identity of the scenes and set points of ours.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenes: Option<String>,
}

impl OutcomeRow {
    /// Counts the outcomes of a hand, a family, an engine and its settings.
    pub(super) fn of(names: [&str; 4], plan: &Plan, Outcomes { runs, kept }: &Outcomes) -> Self {
        let of = |run: &&Run| [&*run.hand, &*run.family, &*run.engine, &*run.settings] == names;
        let runs: Vec<&Run> = runs.iter().filter(of).collect();
        let kept: Vec<&Cell> = kept.iter().filter(|it| it.of == names).map(|it| &it.cell).collect();
        let cell = |step_ms: &f64| match kept.iter().find(|cell| cell.step_ms == *step_ms) {
            Some(cell) => (*cell).clone(),
            None => Cell::of(*step_ms, runs.iter().filter(|run| run.step_ms == *step_ms).copied().collect()),
        };
        let cells: Vec<Cell> = plan.steps_ms.iter().map(cell).collect();
        let played = cells.iter().map(|cell| &*cell.endings).filter(|endings| !endings.is_empty());
        let flips = Flips::of_endings(&played.collect::<Vec<_>>());
        let [hand, family, engine, settings] = names.map(str::to_owned);
        let by_grasp: BTreeMap<usize, String> =
            runs.iter().map(|run| (run.index, run.scene.clone())).collect();
        let scenes: Vec<String> = by_grasp.into_values().collect();
        let scenes = (engine == EngineKind::Own.name()).then(|| scene_id::of_all(&scenes));
        OutcomeRow { hand, family, engine, settings, cells, flips, scenes }
    }
}
