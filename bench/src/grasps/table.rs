//! All runs of a plan, counted.

use super::family::{self, Family, HandKind};
use super::play::Ending;
use super::runner::{Plan, Run};
use super::tally::{Count, Flips, wilson};
use crate::report::machine::{Machine, commit};
use serde::Serialize;

/// What the page and the JSON say.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Table {
    /// Version of this format.
    pub format: u32,
    /// Commit of the program.
    pub commit: String,
    /// Where it ran.
    pub machine: Machine,
    /// Grasps of each family.
    pub placements: usize,
    /// Steps, ms.
    pub steps_ms: Vec<f64>,
    /// Families that were played, and what they are.
    pub families: Vec<[String; 2]>,
    /// The drawn objects of the catalogue.
    pub catalogue: Vec<String>,
    /// Engines with their settings, and what these are.
    pub engines: Vec<[String; 3]>,
    /// Rows of the tables.
    pub rows: Vec<Row>,
}

/// What an engine made of a family with a hand.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
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
    /// How often the outcome changes with the step.
    pub flips: Flips,
}

/// At one step.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Cell {
    /// ms
    pub step_ms: f64,
    /// How each grasp ended, in the order of the draw: k kept, o overlapping too deeply, l not lifted, h lost while held, s
    /// lost while shaken, d diverged, n not finished.
    pub endings: String,
    /// Counts.
    pub count: Count,
    /// Bounds of the proportion kept at 95 %.
    pub wilson: [f64; 2],
    /// Median of the deepest overlap of the grasps that were not lost, mm.
    pub overlap_mm: Option<f64>,
}

impl Table {
    /// Counts the runs of a plan.
    pub(super) fn of(plan: &Plan, runs: &[Run]) -> Self {
        let mut rows = Vec::new();
        for hand in &plan.hands {
            for family in &plan.families {
                for engine in &plan.engines {
                    let of: Vec<&Run> = runs
                        .iter()
                        .filter(|run| run.hand == hand.name() && run.family == family.name())
                        .filter(|run| run.engine == engine.name() && run.settings == engine.settings())
                        .collect();
                    if !of.is_empty() {
                        rows.push(Row::of(*hand, *family, [engine.name(), engine.settings()], plan, &of));
                    }
                }
            }
        }
        let played = |family: &&Family| rows.iter().any(|row| row.family == family.name());
        let families: Vec<&Family> = plan.families.iter().filter(played).collect();
        let catalogue = if families.contains(&&Family::Catalogue) { family::items() } else { Vec::new() };
        let text = str::to_owned;
        Table {
            format: 1,
            commit: commit(),
            machine: Machine::here(),
            placements: plan.placements,
            steps_ms: plan.steps_ms.clone(),
            families: families.into_iter().map(|it| [it.name(), it.about()].map(text)).collect(),
            catalogue: catalogue.into_iter().map(|item| item.object.name.clone()).collect(),
            engines: plan
                .engines
                .iter()
                .map(|it| [it.name(), it.settings(), it.about_settings()].map(text))
                .collect(),
            rows,
        }
    }
}

impl Row {
    fn of(hand: HandKind, family: Family, engine: [&str; 2], plan: &Plan, runs: &[&Run]) -> Self {
        let at = |step_ms: &f64| runs.iter().filter(|run| run.step_ms == *step_ms).copied().collect();
        let [engine, settings] = engine.map(str::to_owned);
        Row {
            hand: hand.name().to_owned(),
            family: family.name().to_owned(),
            engine,
            settings,
            cells: plan.steps_ms.iter().map(|step_ms| Cell::of(*step_ms, at(step_ms))).collect(),
            flips: Flips::of(runs.iter().copied()),
        }
    }
}

impl Cell {
    fn of(step_ms: f64, mut runs: Vec<&Run>) -> Self {
        runs.sort_by_key(|run| run.index);
        let count = Count::of(runs.iter().copied());
        let letter = |run: &&Run| match run.fate.ending {
            Ending::OutcomeCache => 'k',
            Ending::Overlapping => 'o',
            Ending::NotLifted => 'l',
            Ending::LostHeld => 'h',
            Ending::LostShaken => 's',
            Ending::Diverged => 'd',
            Ending::NotFinished => 'n',
        };
        let there = |run: &&&Run| matches!(run.fate.ending, Ending::OutcomeCache | Ending::Overlapping);
        let mut depths: Vec<f64> = runs.iter().filter(there).map(|run| run.fate.overlap_mm).collect();
        depths.sort_by(f64::total_cmp);
        Cell {
            step_ms,
            endings: runs.iter().map(letter).collect(),
            count,
            wilson: wilson(count.kept, count.of),
            overlap_mm: depths.get(depths.len() / 2).copied(),
        }
    }
}
