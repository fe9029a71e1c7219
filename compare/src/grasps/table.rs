//! All runs of a plan, counted.

use super::cell::Cell;
use super::pairs::{self, Pairs};
use super::row::OutcomeRow;
use super::runner::{Outcomes, Plan};
use super::tally::{Count, Flips};
use crate::engine::EngineKind;
use crate::peer_key::Kept;
use crate::trials::family::{self, Family};
use anyhow::{Context, Result, ensure};
use palmares_bench::record::Record;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Version of the JSON.
const FORMAT: u32 = 1;

/// The content of the page and the JSON.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Table {
    /// [`FORMAT`].
    pub format: u32,
    /// Engine, models, commit, day and machine.
    #[serde(flatten)]
    pub record: Record,
    /// Grasps of each family.
    pub placements: usize,
    /// CPU time that a run of a peer had at most, s. Tables of runs that were limited by the clock on the wall have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run_limit_cpu_s: Option<f64>,
    /// Steps, ms.
    pub steps_ms: Vec<f64>,
    /// Families that were played, and what they are.
    pub families: Vec<[String; 2]>,
    /// The drawn objects of the catalogue.
    pub catalogue: Vec<String>,
    /// Engines with their settings, and what these are.
    pub engines: Vec<[String; 3]>,
    /// Rows of the tables.
    pub rows: Vec<OutcomeRow>,
    /// Ours beside the engine before, where an earlier table has it with the same grasps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before: Option<Pairs>,
}

impl Table {
    /// Counts the outcomes of a plan.
    pub(super) fn of(record: Record, plan: &Plan, outcomes: &Outcomes) -> Self {
        let mut rows = Vec::new();
        for hand in &plan.hands {
            for family in &plan.families {
                for engine in &plan.engines {
                    let names = [hand.name(), family.name(), engine.name(), engine.settings()];
                    let row = OutcomeRow::of(names, plan, outcomes);
                    rows.extend(row.cells.iter().any(|cell| !cell.endings.is_empty()).then_some(row));
                }
            }
        }
        let played = |family: &&Family| rows.iter().any(|row| row.family == family.name());
        let families: Vec<&Family> = plan.families.iter().filter(played).collect();
        let catalogue = if families.contains(&&Family::Catalogue) { family::items() } else { Vec::new() };
        let text = str::to_owned;
        Table {
            format: FORMAT,
            record,
            placements: plan.placements,
            run_limit_cpu_s: Some(plan.run_limit_s),
            steps_ms: plan.steps_ms.clone(),
            families: families.into_iter().map(|it| [it.name(), it.about()].map(text)).collect(),
            catalogue: catalogue.into_iter().map(|item| item.object.name.clone()).collect(),
            engines: plan
                .engines
                .iter()
                .map(|it| [it.name(), it.settings(), it.about_settings()].map(text))
                .collect(),
            rows,
            before: None,
        }
    }
}

impl Table {
    /// The cells of peers that a later table may keep, by their keys.
    pub(super) fn kept(&self) -> BTreeMap<String, Cell> {
        let Record { commit, date, .. } = &self.record;
        let this = || Kept { commit: commit.clone(), date: date.clone(), time_factor: None };
        let cells = self.rows.iter().flat_map(|row| &row.cells).filter_map(|cell| {
            let kept = cell.kept.clone().unwrap_or_else(this);
            Some((cell.key.clone()?, Cell { kept: Some(kept), ..cell.clone() }))
        });
        cells.collect()
    }

    /// Sets ours beside the engine before. A table of the same engine has the same outcomes: its own engine before counts.
    pub(super) fn pair_with(&mut self, earlier: &Table) {
        self.before = match earlier.record.engine == self.record.engine {
            true => earlier.before.clone(),
            false => {
                let Record { commit, engine, .. } = &earlier.record;
                pairs::of([commit, engine], earlier.ours(), self.ours())
            }
        };
    }

    /// Rows of ours.
    fn ours(&self) -> impl Iterator<Item = &OutcomeRow> + Clone {
        self.rows.iter().filter(|row| row.engine == EngineKind::Own.name())
    }
}

/// Outcomes of an engine over several families.
pub(crate) struct Sum<'a> {
    /// The engine.
    pub engine: &'a str,
    /// Its settings.
    pub settings: &'a str,
    /// At each step.
    pub counts: Vec<Count>,
    /// Changes of the outcome with the step.
    pub flips: Flips,
}

impl<'a> Sum<'a> {
    /// That of one family alone.
    pub(super) fn of(row: &'a OutcomeRow) -> Self {
        let counts = row.cells.iter().map(|cell| cell.count).collect();
        Sum { engine: &row.engine, settings: &row.settings, counts, flips: row.flips }
    }

    /// Over all steps.
    pub(crate) fn all(&self) -> Count {
        self.counts.iter().fold(Count::default(), |sum, count| sum + *count)
    }
}

impl Table {
    /// Reads a written table.
    ///
    /// # Errors
    /// No such file, or not of this format.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let table: Table = serde_json::from_str(&text)
            .with_context(|| format!("{} are no counts of format {FORMAT}", path.display()))?;
        ensure!(table.format == FORMAT, "{}: format {} is not {FORMAT}", path.display(), table.format);
        Ok(table)
    }

    /// All drawn families together with a hand, for every engine with its settings, at every step.
    pub(crate) fn drawn(&self, hand: &str) -> Vec<Sum<'_>> {
        let drawn = |row: &&OutcomeRow| Family::DRAWN.iter().any(|family| row.family == family.name());
        let mut sums = Vec::new();
        for [engine, settings, _] in &self.engines {
            let of =
                |row: &&OutcomeRow| row.hand == hand && row.engine == *engine && row.settings == *settings;
            let rows: Vec<&OutcomeRow> = self.rows.iter().filter(of).filter(drawn).collect();
            if !rows.is_empty() {
                let cells = |row: &OutcomeRow| -> Vec<Cell> {
                    let of = |step_ms: &f64| row.cells.iter().find(|cell| cell.step_ms == *step_ms).cloned();
                    self.steps_ms.iter().filter_map(of).collect()
                };
                let mut counts = vec![Count::default(); self.steps_ms.len()];
                let mut flips = Flips::default();
                for cells in rows.into_iter().map(cells) {
                    for (count, cell) in counts.iter_mut().zip(&cells) {
                        *count = *count + cell.count;
                    }
                    let played = cells.iter().filter(|cell| !cell.endings.is_empty());
                    flips = flips + Flips::of_endings(&played.map(|cell| &*cell.endings).collect::<Vec<_>>());
                }
                sums.push(Sum { engine, settings, counts, flips });
            }
        }
        sums
    }
}

/// The settings of each peer with which it keeps the largest part, over all steps that were played.
pub(crate) fn best<'a, 'b>(sums: &'b [Sum<'a>]) -> Vec<&'b Sum<'a>> {
    let mut peers: Vec<&str> = sums.iter().map(|sum| sum.engine).filter(|it| *it != "own").collect();
    peers.dedup();
    let part = |sum: &Sum| sum.all().kept as f64 / sum.all().of.max(1) as f64;
    let best = |peer: &str| {
        let of_peer = sums.iter().filter(|sum| sum.engine == peer);
        of_peer.max_by(|a, b| part(a).total_cmp(&part(b)))
    };
    peers.into_iter().filter_map(best).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_were_kept_before_keep_their_day() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/report/grasps/grasps.json");
        let mut table = Table::read(&page).expect("the page's counts");
        table.rows.truncate(2);
        let old = Kept { commit: "old".into(), date: "2026-01-01".into(), time_factor: None };
        for (key, row, kept) in [("a", 0, None), ("b", 1, Some(old.clone()))] {
            table.rows[row].cells.truncate(2);
            (table.rows[row].cells[0].key, table.rows[row].cells[1].key) = (Some(key.to_owned()), None);
            table.rows[row].cells[0].kept = kept;
        }
        let kept = table.kept();
        let commits: Vec<(&str, &str)> =
            kept.iter().map(|(key, cell)| (&**key, &*cell.kept.as_ref().expect("kept").commit)).collect();
        assert_eq!(commits, [("a", &*table.record.commit), ("b", "old")], "a cell without a key is not kept");
    }
}
