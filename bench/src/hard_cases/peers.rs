//! What other engines have done in a case, as the committed reports say.

use crate::case_report::Figure;
use crate::record::root;
use anyhow::{Context, Result};
use serde::Deserialize;
use std::fs;

/// The reports, from the root of the repository.
const REPORTS: [&str; 3] =
    ["docs/report/report.json", "docs/report/hands/report.json", "docs/report/further/report.json"];

/// The part of a report that is read.
#[derive(Deserialize)]
struct Report {
    runs: Vec<PeerRun>,
}

/// A run of a case at a step.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct PeerRun {
    /// Name of the case.
    pub(super) case: String,
    /// Name of the engine.
    pub(super) engine: String,
    /// Name of its settings.
    pub(super) settings: String,
    /// Step, ms.
    pub(super) dt_ms: f64,
    /// The case's figure; none if the run did not end.
    error: Option<Figure>,
    /// Reason why the run does not solve the scene.
    trouble: Option<String>,
    /// Whether it did not end in its time.
    #[serde(default)]
    unfinished: bool,
    /// Whether the adapter does not pass on what the scene needs.
    #[serde(default)]
    not_played: bool,
    /// The outcomes from many starts, where there are.
    starts: Option<PeerStarts>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct PeerStarts {
    tried: u32,
    #[serde(default)]
    unfinished: u32,
    done: u32,
}

impl PeerRun {
    /// Whether the report says that it solves the scene: from many starts, at least half of them.
    fn solves(&self) -> bool {
        match self.starts {
            Some(starts) => 2 * starts.done >= starts.tried + starts.unfinished,
            None => self.trouble.is_none(),
        }
    }

    /// Its figure without a sign.
    fn figure(&self) -> f64 {
        self.error.as_ref().and_then(|error| error.value).map_or(f64::INFINITY, f64::abs)
    }
}

/// Runs of other engines in all reports.
pub(super) struct Peers(Vec<PeerRun>);

/// What a peer has done at its best.
pub(super) enum Best<'a> {
    /// Of the runs that solve the scene, the one at the longest step, and the one with the smallest error, with it.
    Solves {
        /// Of several settings the one with the smaller error.
        longest: &'a PeerRun,
        /// Of several steps the longest.
        nearest: &'a PeerRun,
        /// The smallest error.
        figure: &'a Figure,
    },
    /// None of its runs solves the scene.
    Fails,
    /// None solves it, and some did not end in their time.
    Unfinished,
}

impl Peers {
    /// Reads the reports.
    ///
    /// # Errors
    /// A report is missing or has another format.
    pub(super) fn read() -> Result<Self> {
        let mut runs = Vec::new();
        for file in REPORTS {
            let text =
                fs::read_to_string(root().join(file)).with_context(|| format!("cannot read {file}"))?;
            let report: Report = serde_json::from_str(&text).with_context(|| file.to_owned())?;
            runs.extend(report.runs.into_iter().filter(|run| run.engine != "own"));
        }
        Ok(Peers(runs))
    }

    /// The peers that have played a case, with their best.
    pub(super) fn of(&self, case: &str) -> Vec<(&str, Best<'_>)> {
        let played = || self.0.iter().filter(|run| run.case == case && !run.not_played);
        let mut names: Vec<&str> = played().map(|run| &*run.engine).collect();
        names.sort_unstable();
        names.dedup();
        let best = |name: &&str| {
            let runs = || played().filter(|run| run.engine == **name);
            let solve = || runs().filter(|run| run.solves());
            let by_step = |a: &&PeerRun, b: &&PeerRun| a.dt_ms.total_cmp(&b.dt_ms);
            let by_error = |a: &&PeerRun, b: &&PeerRun| b.figure().total_cmp(&a.figure());
            let longest = solve().max_by(|a, b| by_step(a, b).then(by_error(a, b)));
            let nearest = solve().max_by(|a, b| by_error(a, b).then(by_step(a, b)));
            match longest
                .zip(nearest)
                .and_then(|(longest, nearest)| Some((longest, nearest, nearest.error.as_ref()?)))
            {
                Some((longest, nearest, figure)) => Best::Solves { longest, nearest, figure },
                None if runs().any(|run| run.unfinished) => Best::Unfinished,
                None => Best::Fails,
            }
        };
        names.iter().map(|name| (*name, best(name))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(settings: &str, dt_ms: f64, value: f64, trouble: Option<&str>) -> PeerRun {
        PeerRun {
            case: "mass_ratio".into(),
            engine: "peer".into(),
            settings: settings.into(),
            dt_ms,
            error: Some(Figure::new("motion", value, "mm")),
            trouble: trouble.map(str::to_owned),
            unfinished: false,
            not_played: false,
            starts: None,
        }
    }

    #[test]
    fn the_best_are_the_longest_step_and_the_smallest_error_of_the_runs_that_solve_the_scene() {
        let runs = vec![
            run("soft", 2.0, 0.1, None),
            run("soft", 1.0, -0.1, None),
            run("stiff", 4.0, -0.3, None),
            run("hard", 4.0, 0.2, None),
            run("hard", 8.0, 0.01, Some("object lost")),
        ];
        let peers = Peers(runs);
        let [("peer", Best::Solves { longest, nearest, figure })] = &peers.of("mass_ratio")[..] else {
            panic!("it solves the scene");
        };
        assert_eq!((&*longest.settings, longest.dt_ms), ("hard", 4.0));
        assert_eq!((&*nearest.settings, nearest.dt_ms, figure.value), ("soft", 2.0, Some(0.1)));
        assert!(peers.of("kapla").is_empty());
    }

    #[test]
    fn what_is_not_played_or_unfinished_is_no_failure() {
        let failed = run("stiff", 1.0, 9.0, Some("overlap"));
        let of = |run: PeerRun| Peers(vec![failed.clone(), run]).of("mass_ratio").len();
        assert!(matches!(Peers(vec![failed.clone()]).of("mass_ratio")[..], [(_, Best::Fails)]));
        assert_eq!(of(PeerRun { engine: "other".into(), not_played: true, ..failed.clone() }), 1);
        let long = PeerRun { unfinished: true, ..failed.clone() };
        assert!(matches!(Peers(vec![failed, long]).of("mass_ratio")[..], [(_, Best::Unfinished)]));
    }

    #[test]
    fn half_of_many_starts_must_succeed() {
        let starts = |done| Some(PeerStarts { tried: 8, unfinished: 0, done });
        let of = |done| PeerRun { starts: starts(done), ..run("stiff", 1.0, 0.0, None) }.solves();
        assert!(of(4) && !of(3));
    }

    #[test]
    fn the_committed_reports_are_read() {
        let peers = Peers::read().expect("they are in the repository");
        assert!(!peers.of("mass_ratio").is_empty() && !peers.of("hard_overlap").is_empty());
    }
}
