//! The table of runs, with which replays are compared.

use super::verdict::Verdict;
use anyhow::{Context, bail, ensure};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A run of the table.
#[derive(Clone, Debug, Deserialize)]
struct ListedRun {
    run_id: String,
    team: String,
    status: String,
    score: Option<f64>,
    /// None if the run has no replay: it had no tick, the replay was lost, or a practice replay was deleted.
    replay_sha256: Option<String>,
    /// Whether the replay is in the shared storage: in a data directory it may be missing.
    #[serde(default)]
    stored: bool,
}

/// The table of runs.
pub(super) struct RunTable {
    place: String,
    runs: BTreeMap<String, ListedRun>,
}

/// A difference between the table and the replays.
pub(super) struct Difference {
    run_id: String,
    /// `missing`, `differs` or `unnamed`.
    kind: &'static str,
    message: String,
}

impl Difference {
    /// A line for people.
    pub(super) fn text(&self) -> String {
        format!("{}: {}: {}", self.run_id, self.kind, self.message)
    }

    /// A JSON object.
    pub(super) fn json(&self) -> Value {
        json!({"run_id": self.run_id, "difference": self.kind, "message": self.message})
    }
}

impl RunTable {
    /// Reads an export of the runs, CSV or JSON.
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        let place = path.display().to_string();
        let text = std::fs::read_to_string(path).with_context(|| format!("--runs {place}"))?;
        let runs = if text.trim_start().starts_with('[') { from_json(&text) } else { from_csv(&text) };
        let what = "expected the output of `palmares admin export runs`, as csv or json";
        Self::new(place.clone(), runs.with_context(|| format!("--runs {place}: {what}"))?)
    }

    /// The table in the database of a data directory, if a source is one, or its folder of replays.
    #[cfg(feature = "server")]
    pub(super) fn of(source: &Path) -> anyhow::Result<Option<Self>> {
        let inside = source.ends_with("replays").then(|| source.parent()).flatten();
        for folder in [Some(source), inside].into_iter().flatten() {
            let place = folder.join("palmares.sqlite");
            if place.is_file() {
                let place = place.display().to_string();
                let runs = palmares_server::runs_in(folder).with_context(|| place.clone())?;
                let runs = runs.into_iter().map(serde_json::from_value).collect::<Result<_, _>>()?;
                return Ok(Some(Self::new(place, runs)?));
            }
        }
        Ok(None)
    }

    /// Without the server's libraries no database is read.
    #[cfg(not(feature = "server"))]
    pub(super) fn of(_: &Path) -> anyhow::Result<Option<Self>> {
        Ok(None)
    }

    fn new(place: String, runs: Vec<ListedRun>) -> anyhow::Result<Self> {
        let mut by_id = BTreeMap::new();
        for run in runs {
            let run_id = run.run_id.clone();
            ensure!(by_id.insert(run_id.clone(), run).is_none(), "{place}: {run_id} is there twice");
        }
        Ok(RunTable { place, runs: by_id })
    }

    /// Its file.
    pub(super) fn place(&self) -> &str {
        &self.place
    }

    /// Compares the table with the replays. `found` has the names of all replays, `verified` the verdicts on those that are verified.
    pub(super) fn compare(&self, found: &[String], verified: &BTreeMap<String, Verdict>) -> Vec<Difference> {
        let stem = |name: &String| {
            let name = name.rsplit('/').next().unwrap_or(name);
            name.strip_suffix(".mcap").unwrap_or(name).to_owned()
        };
        // A file has the name of its run, in a bucket its own digest. A refused one is there, too.
        let mut there: BTreeSet<String> = found.iter().map(stem).collect();
        let mut differences = Vec::new();
        for (file, verdict) in verified {
            let Verdict::Verified { run_id, score, sha256, .. } = verdict else { continue };
            there.insert(run_id.clone());
            let kind_and_message = match self.runs.get(run_id) {
                None => {
                    Some(("unnamed", format!("{file} verifies, but no run in {} has this id", self.place)))
                }
                Some(run) => run.differs(*score, sha256).map(|why| ("differs", format!("{file}: {why}"))),
            };
            if let Some((kind, message)) = kind_and_message {
                differences.push(Difference { run_id: run_id.clone(), kind, message });
            }
        }
        for run in self.runs.values().filter(|run| run.status != "open") {
            let Some(sha256) = &run.replay_sha256 else { continue };
            if !run.stored && !there.contains(&run.run_id) && !there.contains(sha256) {
                let message = format!("the {} run of {:?} has no replay here", run.status, run.team);
                differences.push(Difference { run_id: run.run_id.clone(), kind: "missing", message });
            }
        }
        differences
    }
}

impl ListedRun {
    /// Why a replay is not the run's.
    fn differs(&self, score: f64, sha256: &str) -> Option<String> {
        match (&self.replay_sha256, self.score) {
            (None, _) => Some(format!("the {} run has no replay in the table", self.status)),
            (_, Some(listed)) if listed != score => {
                Some(format!("the score is {score} in the replay, {listed} in the table"))
            }
            (_, None) => Some(format!("the score is {score} in the replay, and the table has none")),
            // Another program may not report the digest.
            (Some(listed), _) if !sha256.is_empty() && listed != sha256 => {
                Some(format!("its SHA-256 is {sha256}, {listed} in the table"))
            }
            _ => None,
        }
    }
}

fn from_json(text: &str) -> anyhow::Result<Vec<ListedRun>> {
    Ok(serde_json::from_str(text)?)
}

fn from_csv(text: &str) -> anyhow::Result<Vec<ListedRun>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let head = reader.headers()?.clone();
    for column in ["run_id", "team", "status", "score", "replay_sha256"] {
        if !head.iter().any(|name| name == column) {
            bail!("no column `{column}`");
        }
    }
    Ok(reader.deserialize().collect::<Result<_, _>>()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(run_id: &str, score: f64, sha256: &str) -> Verdict {
        let (team, task, hand, key) = ("crabs".into(), "balls".into(), "pinch".into(), String::new());
        let (run_id, sha256) = (run_id.into(), sha256.into());
        Verdict::Verified { run_id, team, task, hand, score, ticks: 1, states: 1, key, sha256 }
    }

    #[test]
    fn a_table_names_every_replay_and_every_replay_is_named() {
        let csv = "run_id,team,status,score,replay_sha256,other\n\
                   run_1,crabs,verified,1.5,aa,\nrun_2,crabs,verified,2,bb,\nrun_3,crabs,verified,3,cc,\n\
                   run_4,crabs,voided,4,dd,\nrun_5,crabs,aborted,0,,\nrun_6,crabs,open,,,\nrun_7,crabs,verified,7,ee,\n";
        let table = RunTable::new("runs.csv".into(), from_csv(csv).expect("reads")).expect("a table");
        let files =
            ["a/run_1.mcap", "a/run_2.mcap", "a/run_3.mcap", "a/run_9.mcap", "s3://cup/replays/ee.mcap"];
        let verdicts =
            [verdict("run_1", 1.5, "aa"), verdict("run_2", 2.5, "bb"), verdict("run_3", 3.0, "xx")];
        let last = [verdict("run_9", 9.0, "99"), verdict("run_7", 7.0, "")];
        let verified =
            files.iter().map(|file| (*file).to_owned()).zip(verdicts.into_iter().chain(last)).collect();
        let found: Vec<String> = files.iter().map(|file| (*file).to_owned()).collect();
        let differences = table.compare(&found, &verified);
        let kinds: Vec<_> = differences.iter().map(|one| (one.run_id.as_str(), one.kind)).collect();
        let expected =
            [("run_2", "differs"), ("run_3", "differs"), ("run_9", "unnamed"), ("run_4", "missing")];
        assert_eq!(kinds, expected);
        // A refused file is there: its refusal is said anyway.
        assert!(
            table.compare(&["run_4.mcap".into()], &BTreeMap::new()).iter().all(|one| one.run_id != "run_4")
        );
    }

    #[test]
    fn an_export_is_read_in_both_formats_and_another_file_is_refused() {
        let json = r#"[{"run_id":"run_1","team":"crabs","status":"verified","score":1.5,"replay_sha256":"aa","k":1}]"#;
        assert_eq!(from_json(json).expect("reads")[0].score, Some(1.5));
        let error = from_csv("rank,team\n1,crabs\n").expect_err("the leaderboard").to_string();
        assert_eq!(error, "no column `run_id`");
    }
}
