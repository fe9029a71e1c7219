//! The result of one peer in one case, and whether it is ahead of ours.

use serde::{Deserialize, Serialize};

/// One peer in one case, over the steps that both have played.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct PeerResult {
    /// The case.
    pub case: String,
    /// The peer.
    pub peer: String,
    /// The steps that count, ms: those that ours and the peer with each of its settings have played.
    #[serde(default)]
    pub steps_ms: Vec<f64>,
    /// Its results with each of its settings, the best first.
    pub settings: Vec<SettingsResult>,
    /// Whether all runs that solve the scene were timed.
    #[serde(default)]
    pub timed: bool,
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
    /// Steps with which its adapter does not pass on what the scene needs: they are not tried.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub not_played: usize,
    /// Steps, ms, at which no run of ours has at most its error in at most its time.
    pub ahead_ms: Vec<f64>,
    /// Least ratio of its time to that of our fastest run with at most its error; none when nothing compares.
    pub least_advantage: Option<f64>,
    /// Deepest overlap of the usable runs, mm.
    pub overlap_mm: Option<f64>,
    /// Least and most difference of those from its own fine run, if that is the case's figure.
    pub differs: Option<[f64; 2]>,
}

/// The verdict of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Ours solves the scene, and no run of the peer is faster at an equal or smaller error.
    Won,
    /// A run of the peer is.
    Lost,
    /// Neither solves the scene at any step.
    Neither,
    /// No run of the peer solves the scene and some did not end in their time, or those that solve it were not timed.
    Unknown,
    /// The peer's adapter does not pass on what the scene needs.
    NotPlayed,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl SettingsResult {
    /// The smaller, the better for the peer: ahead of ours, then nearly so, then at more steps.
    pub(super) fn rank(&self) -> (bool, bool, f64, usize) {
        let ratio = self.least_advantage.unwrap_or(f64::INFINITY);
        (self.done == 0, self.ahead_ms.is_empty(), ratio, self.tried - self.done - self.unfinished)
    }

    /// The steps with which it solves the scene, in words.
    pub(super) fn steps(&self) -> String {
        let SettingsResult { done, tried, .. } = self;
        match self.unfinished {
            _ if self.not_played > 0 && *tried == 0 => "not played".to_owned(),
            0 => format!("{done} of {tried}"),
            n => format!("{done} of {tried}, {n} unfinished"),
        }
    }
}

impl PeerResult {
    /// The peer's best settings for this scene, if any solve it: those that are ahead of ours or come nearest.
    pub fn best(&self) -> Option<&SettingsResult> {
        self.settings.first().filter(|best| best.done > 0)
    }

    /// The steps with which the peer solves the scene with its best settings, in words.
    pub(super) fn steps(&self) -> String {
        self.settings.first().map_or("none".to_owned(), SettingsResult::steps)
    }

    /// The settings with which the peer solves the scene at most steps, if any do.
    pub fn surest(&self) -> Option<&SettingsResult> {
        let most = self.settings.iter().map(|outcome| outcome.done).max()?;
        self.settings.iter().find(|outcome| outcome.done == most && most > 0)
    }

    /// The verdict.
    pub fn verdict(&self) -> Verdict {
        let all = |of: fn(&SettingsResult) -> bool| self.settings.iter().all(of);
        let solved = self.best().is_some();
        if !all(|outcome| outcome.ahead_ms.is_empty()) || self.own_done == 0 && solved {
            Verdict::Lost
        } else if all(|outcome| outcome.tried == 0) && !all(|outcome| outcome.not_played == 0) {
            Verdict::NotPlayed
        } else if all(|outcome| outcome.tried == 0)
            || !solved && !all(|outcome| outcome.unfinished == 0)
            || solved && !self.timed
        {
            Verdict::Unknown
        } else if self.own_done == 0 {
            Verdict::Neither
        } else {
            Verdict::Won
        }
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
        let words = match (self.verdict(), self.best()) {
            (Verdict::NotPlayed, _) => "not played".into(),
            (Verdict::Unknown, _) => "undecided".into(),
            (Verdict::Neither, _) => "neither does it".into(),
            (Verdict::Lost, _) => format!("**the peer is ahead** at {}", self.ahead()),
            (Verdict::Won, None) => "the peer does it at no step".into(),
            (Verdict::Won, Some(best)) => match best.times_as_fast() {
                Some(times) => format!("ours is never slower; {times}"),
                None => "ours is never slower".into(),
            },
        };
        match count(|outcome| outcome.unfinished) {
            0 => words,
            n => format!("{words}; {n} of the peer's {} runs are unfinished", count(|outcome| outcome.tried)),
        }
    }
}

impl SettingsResult {
    /// The least advantage of ours in words.
    pub fn times_as_fast(&self) -> Option<String> {
        Some(format!("at least {:.1} times as fast", self.least_advantage?))
    }
}
