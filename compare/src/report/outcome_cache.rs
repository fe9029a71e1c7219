//! Outcomes of a report's runs that are known. Ours are in a file of the program's commit: they do not depend on the clock, so
//! that they can be gathered in several parts while the machine does other work. Those of peers are known by their
//! [key](crate::peer_key), from that file and from an earlier report, which has their times, too.

use super::comparison::Run;
use super::job::Job;
use crate::peer_key::Kept;
use anyhow::Result;
use palmares_bench::record;
use palmares_bench::run_log::{RunLog, is_of_commit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    commit: String,
    /// Whether the report is quick: its references are coarser.
    quick: bool,
    /// Day, UTC.
    date: String,
    run: Run,
}

/// Runs of peers that need not be played.
pub(super) enum Peers {
    /// Those of an earlier report, by their keys, and those of the file from any commit.
    Kept(BTreeMap<String, Run>),
    /// None but those that this commit has played.
    Anew,
}

/// The known outcomes, and the file.
pub(super) struct OutcomeCache {
    commit: String,
    quick: bool,
    /// Ours, by case and step in ns.
    ours: BTreeMap<(String, u64), Run>,
    /// Those of peers, by their keys.
    peers: BTreeMap<String, Run>,
    log: RunLog,
}

fn ns(dt_ms: f64) -> u64 {
    (dt_ms * 1e6).round() as u64
}

impl OutcomeCache {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be made or written.
    pub(super) fn open(file: &Path, commit: &str, quick: bool, known: Peers) -> Result<Self> {
        let (mut ours, mut peers) = (BTreeMap::new(), BTreeMap::new());
        let (log, lines) = RunLog::open::<Line>(file)?;
        for Line { commit: of, quick: coarse, date, mut run } in lines {
            let same = is_of_commit(&of, commit);
            match run.key.clone() {
                Some(key) if same || matches!(known, Peers::Kept(_)) => {
                    run.kept = (!same).then_some(Kept { commit: of, date, time_factor: None });
                    peers.insert(key, run);
                }
                None if same && coarse == quick => {
                    ours.insert((run.case.clone(), ns(run.dt_ms)), run);
                }
                _ => {}
            }
        }
        if let Peers::Kept(kept) = known {
            peers.extend(kept);
        }
        Ok(OutcomeCache { commit: commit.to_owned(), quick, ours, peers, log })
    }

    /// How many runs of these jobs are known by their keys.
    pub(super) fn kept(&self, jobs: &[Job]) -> usize {
        jobs.iter().flat_map(|job| &job.keys).filter(|key| self.peers.contains_key(*key)).count()
    }

    /// The outcome of a job's run, if it is known.
    pub(super) fn get(&self, job: &Job, step: usize, dt_ms: f64) -> Option<Run> {
        let Job { case, kind, scene, keys, .. } = job;
        match keys.get(step) {
            // Settings may have got another name.
            Some(key) => {
                self.peers.get(key).map(|run| Run { settings: kind.settings().to_owned(), ..run.clone() })
            }
            None => {
                let known = self.ours.get(&(case.name.to_owned(), ns(dt_ms)));
                known.filter(|run| run.scene.as_ref() == Some(scene)).cloned()
            }
        }
    }

    /// Keeps an outcome.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn add(&self, run: &Run) -> Result<()> {
        let (commit, date) = (self.commit.clone(), record::today());
        let line = Line { commit, quick: self.quick, date, run: run.clone() };
        self.log.add(&line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::EngineKind;
    use palmares_bench::cases;

    fn job(engine: &str, keys: &[&str]) -> Job {
        Job {
            case: cases::all().find(|case| case.name == "slide_stop").expect("a case"),
            kind: EngineKind::from_names(engine, None).expect("it is known"),
            scene: "scene".into(),
            keys: keys.iter().map(|key| (*key).to_owned()).collect(),
            simulated_s: 1.0,
        }
    }

    fn run(job: &Job) -> Run {
        Run::begun("slide_stop", job.kind, 2.0, "scene", job.keys.first().cloned())
    }

    #[test]
    fn ours_are_known_of_the_commit_and_those_of_peers_by_their_key() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("report.jsonl");
        let (own, peer) = (job("own", &[]), job("rapier", &["abcd"]));
        let none = || Peers::Kept(BTreeMap::new());
        let kept = OutcomeCache::open(&file, "abc", false, none()).expect("a file");
        for job in [&own, &peer] {
            assert!(kept.get(job, 0, 2.0).is_none());
            kept.add(&run(job)).expect("written");
        }
        drop(kept);
        for (commit, quick, peers, knows) in [
            ("abc", false, none(), (true, true)),
            ("abc", true, none(), (false, true)),
            ("abc+", false, none(), (false, true)),
            ("def", false, none(), (false, true)),
            ("abc", false, Peers::Anew, (true, true)),
            ("def", false, Peers::Anew, (false, false)),
        ] {
            let kept = OutcomeCache::open(&file, commit, quick, peers).expect("a file");
            let known = |job: &Job| kept.get(job, 0, 2.0).is_some();
            assert!(!known(&job("rapier", &["another"])));
            assert!(!known(&Job { scene: "another".into(), ..job("own", &[]) }));
            assert_eq!((known(&own), known(&peer)), knows, "{commit} {quick}");
            assert_eq!(
                kept.kept(&[job("own", &[]), job("rapier", &["abcd", "another"])]),
                usize::from(knows.1)
            );
        }
    }

    #[test]
    fn a_run_of_a_report_goes_before_one_of_the_file_because_it_is_timed() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("report.jsonl");
        let peer = job("rapier", &["abcd"]);
        let cache = OutcomeCache::open(&file, "abc", false, Peers::Kept(BTreeMap::new())).expect("a file");
        cache.add(&run(&peer)).expect("written");
        let timed = Run { cpu_s: 0.25, settings: "an old name".into(), ..run(&peer) };
        let kept = Peers::Kept(BTreeMap::from([("abcd".to_owned(), timed)]));
        let known = OutcomeCache::open(&file, "abc", false, kept).expect("a file").get(&peer, 0, 2.0);
        let known = known.expect("it is known");
        assert_eq!((known.cpu_s, &*known.settings), (0.25, "default"));
    }
}
