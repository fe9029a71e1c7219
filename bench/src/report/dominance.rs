//! Is a peer ever faster than ours at an error that is not larger?

use super::comparison::Run;
use serde::{Deserialize, Serialize};

/// The answer for one case and one peer.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct Verdict {
    /// Which case.
    pub case: String,
    /// Which peer.
    pub peer: String,
    /// Steps with which the peer did the case, out of those tried.
    pub usable: usize,
    /// Steps tried.
    pub tried: usize,
    /// Steps of the peer with which it did not come to an end in its time: they say nothing.
    #[serde(default)]
    pub unfinished: usize,
    /// Steps of ours that did it.
    pub own_usable: usize,
    /// Steps of the peer, ms, at which no run of ours has at most its error in at most its time.
    pub ahead_ms: Vec<f64>,
    /// Least ratio of the peer's time to that of our fastest run with at most its error; none when nothing
    /// compares.
    pub least_advantage: Option<f64>,
}

impl Verdict {
    /// Ours was never slower at an equal or smaller error.
    pub fn holds(&self) -> bool {
        self.ahead_ms.is_empty()
    }

    /// In words.
    pub fn words(&self) -> String {
        let steps: Vec<String> = self.ahead_ms.iter().map(|ms| format!("{ms}")).collect();
        let words = match (self.usable, self.holds(), self.least_advantage) {
            (0, ..) if self.unfinished == self.tried => "nothing is known".into(),
            (0, ..) => "the peer does it at no step".into(),
            (_, true, Some(ratio)) => format!("ours is never slower; at least {ratio:.1} times as fast"),
            (_, true, None) => "ours is never slower".into(),
            (_, false, _) => format!("**the peer is ahead** at {} ms", steps.join(", ")),
        };
        match self.unfinished {
            0 => words,
            n => format!("{words}; {n} of the peer's runs did not finish in time"),
        }
    }
}

/// Compares every peer with ours, case by case.
pub fn verdicts(runs: &[Run], own: &str, peers: &[&str]) -> Vec<Verdict> {
    let mut cases: Vec<&str> = Vec::new();
    for run in runs {
        if !cases.contains(&run.case.as_str()) {
            cases.push(&run.case);
        }
    }
    let pairs = cases.iter().flat_map(|case| peers.iter().map(move |peer| (*case, *peer)));
    pairs.filter_map(|(case, peer)| verdict(runs, own, case, peer)).collect()
}

fn verdict(runs: &[Run], own: &str, case: &str, peer: &str) -> Option<Verdict> {
    let by = |engine: &str| -> Vec<&Run> {
        runs.iter().filter(|run| run.case == case && run.engine == engine).collect()
    };
    let (ours, theirs) = (by(own), by(peer));
    if theirs.is_empty() {
        return None;
    }
    let point = |run: &Run| run.judged().map(|error| (error, run.cpu_s, run.dt_ms));
    let own_points: Vec<_> = ours.iter().filter_map(|run| point(run)).collect();
    let points: Vec<_> = theirs.iter().filter_map(|run| point(run)).collect();
    let (mut ahead_ms, mut least): (Vec<f64>, Option<f64>) = (Vec::new(), None);
    for (error, time, dt_ms) in &points {
        let at_most = own_points.iter().filter(|(e, ..)| e <= error).map(|(_, t, _)| *t);
        let fastest = at_most.fold(f64::INFINITY, f64::min);
        if fastest > *time {
            ahead_ms.push(*dt_ms);
        }
        if fastest.is_finite() {
            let ratio = time / fastest;
            least = Some(least.map_or(ratio, |least: f64| least.min(ratio)));
        }
    }
    Some(Verdict {
        case: case.to_owned(),
        peer: peer.to_owned(),
        usable: points.len(),
        tried: theirs.len(),
        unfinished: theirs.iter().filter(|run| run.unfinished).count(),
        own_usable: own_points.len(),
        ahead_ms,
        least_advantage: least,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::comparison::trouble;
    use crate::report::{Figure, Invariants, Times};

    fn run(engine: &str, dt_ms: f64, error: f64, cpu_s: f64) -> Run {
        Run {
            case: "c".into(),
            engine: engine.into(),
            settings: "default".into(),
            dt_ms,
            error: Some(Figure::new("e", error, "mm")),
            invariants: Invariants::default(),
            trouble: None,
            unfinished: false,
            cpu_s,
            cpu_s_between: [cpu_s; 2],
            us_per_step: Times::default(),
        }
    }

    #[test]
    fn a_faster_peer_at_a_smaller_error_is_told() {
        let runs = [run("own", 1.0, 0.5, 0.1), run("peer", 1.0, 0.4, 0.05), run("peer", 2.0, 0.6, 0.2)];
        let verdicts = verdicts(&runs, "own", &["peer"]);
        assert_eq!(verdicts[0].ahead_ms, [1.0]);
        assert!(!verdicts[0].holds());
        assert_eq!(verdicts[0].least_advantage, Some(2.0));
    }

    #[test]
    fn a_faster_peer_at_a_larger_error_is_beaten_by_a_larger_step_of_ours() {
        let runs = [run("own", 1.0, 0.1, 0.1), run("own", 4.0, 0.3, 0.03), run("peer", 4.0, 0.4, 0.05)];
        let verdicts = verdicts(&runs, "own", &["peer"]);
        assert!(verdicts[0].holds(), "{verdicts:?}");
    }

    #[test]
    fn within_a_bound_speed_alone_decides_and_beyond_it_nothing_counts() {
        let bounded = |mut run: Run, value: f64| {
            run.error = Some(Figure::bounded("fastest body", value, "m/s", 1.0));
            run.trouble = trouble(run.error.as_ref().expect("set"), &run.invariants);
            run
        };
        let own = bounded(run("own", 4.0, 0.0, 0.01), 0.9);
        let slower = bounded(run("peer", 1.0, 0.0, 0.05), 0.1);
        let faster = bounded(run("peer", 2.0, 0.0, 0.005), -0.2);
        let thrown = bounded(run("peer", 4.0, 0.0, 0.001), 1.1);
        let verdicts = verdicts(&[own, slower, faster, thrown.clone()], "own", &["peer"]);
        assert_eq!(thrown.trouble.as_deref(), Some("more than 1 m/s"));
        assert_eq!((verdicts[0].usable, verdicts[0].tried), (2, 3));
        assert_eq!(verdicts[0].ahead_ms, [2.0]);
    }

    #[test]
    fn a_run_that_lost_the_object_counts_for_nobody() {
        let mut lost = run("peer", 1.0, 0.01, 0.001);
        lost.trouble = Some("object lost".into());
        let verdicts = verdicts(&[run("own", 1.0, 0.1, 0.1), lost], "own", &["peer"]);
        assert_eq!((verdicts[0].usable, verdicts[0].tried), (0, 1));
    }

    #[test]
    fn a_run_that_did_not_finish_is_told_and_judged_by_nothing() {
        let mut endless = run("peer", 1.0, 0.0, 0.0);
        (endless.error, endless.trouble, endless.unfinished) = (None, Some("not finished".into()), true);
        let alone = verdicts(&[run("own", 1.0, 0.1, 0.1), endless.clone()], "own", &["peer"]);
        assert_eq!(alone[0].words(), "nothing is known; 1 of the peer's runs did not finish in time");
        let ahead = run("peer", 2.0, 0.1, 0.01);
        let both = verdicts(&[run("own", 1.0, 0.1, 0.1), endless, ahead], "own", &["peer"]);
        assert_eq!((both[0].usable, both[0].tried, both[0].unfinished), (1, 2, 1));
        assert_eq!(
            both[0].words(),
            "**the peer is ahead** at 2 ms; 1 of the peer's runs did not finish in time"
        );
    }
}
