//! The result of one peer in one case, and whether it is ahead of ours.

use serde::{Deserialize, Serialize};

/// One peer in one case.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct PeerResult {
    /// The case.
    pub case: String,
    /// The peer.
    pub peer: String,
    /// Its results with each of its settings, the best first.
    pub settings: Vec<SettingsResult>,
    /// Steps of ours that solve the scene.
    pub own_done: usize,
    /// Least and most difference of those from our own fine run, if that is the case's figure.
    pub own_differs: Option<[f64; 2]>,
    /// Unit of these differences.
    pub unit: String,
}

/// One case on a peer with one of its settings.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct SettingsResult {
    /// Name of the settings.
    pub settings: String,
    /// Steps with which it solves the scene, out of those tried.
    pub done: usize,
    /// Steps tried.
    pub tried: usize,
    /// Steps with which it did not end in its time: they say nothing.
    pub unfinished: usize,
    /// Steps, ms, at which no run of ours has at most its error in at most its time.
    pub ahead_ms: Vec<f64>,
    /// Least ratio of its time to that of our fastest run with at most its error; none when nothing compares.
    pub least_advantage: Option<f64>,
    /// Deepest overlap of the usable runs, mm.
    pub overlap_mm: Option<f64>,
    /// Least and most difference of those from its own fine run, if that is the case's figure.
    pub differs: Option<[f64; 2]>,
}

impl SettingsResult {
    /// The smaller, the better for the peer: ahead of ours, then nearly so, then at more steps.
    pub(super) fn rank(&self) -> (bool, bool, f64, usize) {
        let ratio = self.least_advantage.unwrap_or(f64::INFINITY);
        (self.done == 0, self.ahead_ms.is_empty(), ratio, self.tried - self.done)
    }
}

impl PeerResult {
    /// The peer's best settings for this scene, if any solve it.
    pub fn best(&self) -> Option<&SettingsResult> {
        self.settings.first().filter(|best| best.done > 0)
    }

    /// Ours was never slower at an equal or smaller error, with any settings.
    pub fn holds(&self) -> bool {
        self.settings.iter().all(|outcome| outcome.ahead_ms.is_empty())
    }

    /// Steps at which the peer is ahead, with the settings of each.
    pub fn ahead(&self) -> String {
        let ahead = self.settings.iter().filter(|outcome| !outcome.ahead_ms.is_empty()).map(|outcome| {
            let steps: Vec<String> = outcome.ahead_ms.iter().map(|ms| format!("{ms}")).collect();
            format!("{} ms with `{}`", steps.join(", "), outcome.settings)
        });
        ahead.collect::<Vec<_>>().join(", ")
    }

    /// In words.
    pub fn words(&self) -> String {
        let count = |of: fn(&SettingsResult) -> usize| self.settings.iter().map(of).sum::<usize>();
        let unfinished = count(|outcome| outcome.unfinished);
        let words = match self.best() {
            None if unfinished == count(|outcome| outcome.tried) => "nothing is known".into(),
            None => "the peer does it at no step".into(),
            Some(_) if !self.holds() => format!("**the peer is ahead** at {}", self.ahead()),
            Some(SettingsResult { least_advantage: Some(ratio), .. }) => {
                format!("ours is never slower; at least {ratio:.1} times as fast")
            }
            Some(_) => "ours is never slower".into(),
        };
        match unfinished {
            0 => words,
            n => format!("{words}; {n} of the peer's runs did not finish in time"),
        }
    }
}
