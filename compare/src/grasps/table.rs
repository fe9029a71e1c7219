//! All runs of a plan, counted.

use super::runner::{Plan, Run};
use super::tally::{Count, Flips, wilson};
use crate::scene_id;
use crate::trials::family::{self, Family, HandKind};
use crate::trials::play::Ending;
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
}

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
    /// Identity of its scenes and set points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenes: Option<String>,
    /// Commit of the program that played it, if it was kept from an earlier table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commit: Option<String>,
}

/// At one step.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cell {
    /// ms
    pub step_ms: f64,
    /// Ending of each grasp, in the order of the draw: k kept, o overlapping too deeply, l not lifted, h lost
    /// while held, s lost while shaken, d diverged, n not finished.
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
    pub(super) fn of(record: Record, plan: &Plan, runs: &[Run]) -> Self {
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
                        rows.push(OutcomeRow::of(
                            *hand,
                            *family,
                            [engine.name(), engine.settings()],
                            plan,
                            &of,
                        ));
                    }
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
        }
    }
}

impl Table {
    /// Takes over the rows of peers that an earlier table has and this one has not.
    ///
    /// # Errors
    /// The tables are of other families, grasps, steps or limits.
    pub(super) fn keep_peers(&mut self, earlier: Table) -> Result<()> {
        let of = |table: &Table| {
            let names: Vec<String> = table.families.iter().map(|[name, _]| name.clone()).collect();
            let Table { placements, steps_ms, run_limit_cpu_s, .. } = table;
            format!("{placements} of {} at {steps_ms:?} ms, limit {run_limit_cpu_s:?} s", names.join(", "))
        };
        let (before, now) = (of(&earlier), of(self));
        ensure!(before == now, "rows cannot be kept: the earlier table has {before}; this one {now}");
        for engine in earlier.engines {
            if !self.engines.iter().any(|own| own[..2] == engine[..2]) {
                self.engines.push(engine);
            }
        }
        for row in earlier.rows.iter().filter(|row| row.engine != "own") {
            let own = self.rows.iter().find(|own| own.hand == row.hand && own.family == row.family);
            ensure!(
                own.is_none_or(|own| own.scenes == row.scenes),
                "rows cannot be kept: {} `{}` played other scenes in {}",
                row.engine,
                row.settings,
                row.family
            );
        }
        let known =
            |row: &OutcomeRow| [&row.hand, &row.family, &row.engine, &row.settings].map(String::clone);
        for mut row in earlier.rows.into_iter().filter(|row| row.engine != "own") {
            if !self.rows.iter().any(|own| known(own) == known(&row)) {
                row.commit.get_or_insert(earlier.record.commit.clone());
                self.rows.push(row);
            }
        }
        let place = |row: &OutcomeRow| {
            let hand = HandKind::ALL.iter().position(|hand| hand.name() == row.hand);
            let family = self.families.iter().position(|[name, _]| *name == row.family);
            let of = |it: &[String; 3]| it[0] == row.engine && it[1] == row.settings;
            (hand, family, self.engines.iter().position(of))
        };
        self.rows.sort_by_key(place);
        Ok(())
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

impl Sum<'_> {
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

impl OutcomeRow {
    /// As the sum of this family alone.
    pub(super) fn alone(&self) -> Sum<'_> {
        let counts = self.cells.iter().map(|cell| cell.count).collect();
        Sum { engine: &self.engine, settings: &self.settings, counts, flips: self.flips }
    }

    fn of(hand: HandKind, family: Family, engine: [&str; 2], plan: &Plan, runs: &[&Run]) -> Self {
        let at = |step_ms: &f64| runs.iter().filter(|run| run.step_ms == *step_ms).copied().collect();
        let [engine, settings] = engine.map(str::to_owned);
        let by_grasp: BTreeMap<usize, String> =
            runs.iter().map(|run| (run.index, run.scene.clone())).collect();
        let scenes: Vec<String> = by_grasp.into_values().collect();
        OutcomeRow {
            hand: hand.name().to_owned(),
            family: family.name().to_owned(),
            engine,
            settings,
            cells: plan.steps_ms.iter().map(|step_ms| Cell::of(*step_ms, at(step_ms))).collect(),
            flips: Flips::of(runs.iter().copied()),
            scenes: Some(scene_id::of_all(&scenes)),
            commit: None,
        }
    }
}

impl Cell {
    fn of(step_ms: f64, mut runs: Vec<&Run>) -> Self {
        runs.sort_by_key(|run| run.index);
        let count = Count::of(runs.iter().copied());
        let letter = |run: &&Run| match run.fate.ending {
            Ending::Kept => 'k',
            Ending::Overlapping => 'o',
            Ending::NotLifted => 'l',
            Ending::LostHeld => 'h',
            Ending::LostShaken => 's',
            Ending::Diverged => 'd',
            Ending::NotFinished => 'n',
        };
        let there = |run: &&&Run| matches!(run.fate.ending, Ending::Kept | Ending::Overlapping);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_of_an_earlier_table_keep_their_places_and_their_commit() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/report/grasps/grasps.json");
        let all = Table::read(&page).expect("the page's counts");
        let mut own = all.clone();
        own.rows.retain(|row| row.engine == "own");
        own.engines.truncate(1);
        own.record.commit = "later".to_owned();
        own.keep_peers(all.clone()).expect("the same grasps");
        let names = |table: &Table| -> Vec<[String; 4]> {
            let name =
                |row: &OutcomeRow| [&row.hand, &row.family, &row.engine, &row.settings].map(String::clone);
            table.rows.iter().map(name).collect()
        };
        assert_eq!(names(&own), names(&all));
        for row in &own.rows {
            let kept = row.engine != "own";
            assert_eq!(row.commit.is_some(), kept, "{} `{}`", row.engine, row.settings);
            assert!(row.commit.as_ref().is_none_or(|commit| commit != "later"));
        }
        let other_steps = Table { steps_ms: vec![1.0], ..all.clone() };
        let fewer_families = Table { families: all.families[1..].to_vec(), ..all };
        assert!(own.keep_peers(other_steps).is_err() && own.keep_peers(fewer_families).is_err());
    }
}
