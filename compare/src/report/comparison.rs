//! The machine-readable report.

use super::peer_result::{PeerResult, Verdict};
use super::ticks::Ticks;
use crate::engine::{EngineKind, NotPlayed};
use crate::peer_key::Kept;
use crate::played::trouble;
use palmares_bench::case_report::{Figure, Invariants, Times};
use palmares_bench::record::Record;
use serde::{Deserialize, Serialize};

/// Version of this format.
pub const FORMAT: u32 = 2;

/// The content of the report.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// [`FORMAT`].
    pub format: u32,
    /// The part of the pages of record.
    #[serde(default)]
    pub part: String,
    /// Fewer cases, steps and repeats than a full report.
    pub quick: bool,
    /// Engine, models, commit, day and machine.
    #[serde(flatten)]
    pub record: Record,
    /// Timing runs of which the median is given.
    pub repeats: usize,
    /// Time that a run of a peer, or its reference, had at most, s.
    #[serde(default)]
    pub run_limit_s: f64,
    /// By which clock.
    #[serde(default)]
    pub run_limit_by: Clock,
    /// The engines.
    pub engines: Vec<EngineNote>,
    /// One per case, engine and step.
    pub runs: Vec<Run>,
    /// Whether anything is faster than ours at an error that is not larger.
    #[serde(rename = "verdicts")]
    pub results: Vec<PeerResult>,
    /// Kept runs that were played again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sentinels: Option<Sentinels>,
    /// Time of every 10 ms of a grasp.
    pub ticks: Vec<Ticks>,
    /// Cases that were left out, and why.
    pub left_out: Vec<String>,
    /// Duration of the report, s.
    pub took_s: f64,
}

impl Comparison {
    /// The engines that ran.
    pub(super) fn ran(&self) -> Vec<&str> {
        self.engines.iter().filter(|note| note.ran).map(|note| &*note.name).collect()
    }

    /// The source of a run that is taken from here.
    pub(super) fn kept(&self, run: &Run) -> Kept {
        let Record { commit, date, .. } = &self.record;
        let this = || Kept { commit: commit.clone(), date: date.clone(), time_factor: None };
        run.kept.clone().unwrap_or_else(this)
    }

    /// Comparisons in which a peer is ahead.
    pub fn ahead(&self) -> impl Iterator<Item = &PeerResult> {
        self.results.iter().filter(|result| result.verdict() == Verdict::Lost)
    }
}

/// An engine and its settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EngineNote {
    /// As on the command line.
    pub name: String,
    /// Its version, or why it did not run.
    pub version: String,
    /// Whether it ran.
    pub ran: bool,
    /// Step of its reference runs, ms.
    pub reference_ms: f64,
    /// Notes on all its settings.
    pub notes: Vec<String>,
    /// Its settings.
    pub settings: Vec<Choice>,
}

/// Kept runs that were played again for a report.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sentinels {
    /// Their number.
    pub played: usize,
    /// Median of the ratios of their times now to the kept ones; none in a quick report, which leaves kept times as they are.
    pub time_ratio: Option<f64>,
    /// Difference of the ratios in the middle half, as a part of the median.
    pub spread: f64,
}

/// The clock that limits a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// Wall-clock time, as in all reports before CPU time could be limited.
    #[default]
    Wall,
    /// CPU time.
    Cpu,
}

impl Clock {
    /// The unit of its limit in words.
    pub(super) fn words(self) -> &'static str {
        match self {
            Clock::Wall => "by the clock on the wall",
            Clock::Cpu => "of CPU time",
        }
    }
}

/// Named settings of an engine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Choice {
    /// As on the command line.
    pub name: String,
    /// Description, with the reason for the values.
    pub about: String,
}

/// One case on one engine with one step.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Run {
    /// The case.
    pub case: String,
    /// The engine.
    pub engine: String,
    /// Name of its settings.
    pub settings: String,
    /// Step, ms.
    pub dt_ms: f64,
    /// Identity of its scene and commands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// [Key](crate::peer_key) of a peer's run; none of ours, and of runs that are not to be kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<String>,
    /// Where it is kept from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<Kept>,
    /// The case's figure; none if the run did not end.
    pub error: Option<Figure>,
    /// Its checks.
    pub invariants: Invariants,
    /// Reason why the run cannot be used; none if it can.
    pub trouble: Option<String>,
    /// Whether it cannot be used because it did not end in its time.
    #[serde(default)]
    pub unfinished: bool,
    /// Whether it cannot be used because the engine's adapter does not pass on what the scene needs.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub not_played: bool,
    /// The same from many starts, in scenes that are judged by them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub starts: Option<Starts>,
    /// Median over the timing runs of the CPU time for a second of simulated time, s.
    pub cpu_s: f64,
    /// Least and most of [`Run::cpu_s`].
    pub cpu_s_between: [f64; 2],
    /// CPU time per step of the median run; split if the engine reports parts.
    pub us_per_step: Times,
}

/// Results of a scene from many starts that differ by at most a tenth of a millimetre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Starts {
    /// Number of starts whose runs ended.
    pub tried: u32,
    /// Number of further starts whose runs did not end in their time.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub unfinished: u32,
    /// Number of starts from which the run solves the scene.
    pub done: u32,
    /// Median of the deepest overlaps, mm, of an even number the larger of the middle two; none if half of the runs did not end.
    pub median_overlap_mm: Option<f64>,
}

impl Starts {
    /// Whether the scene is solved from at least half of the starts, however the unfinished runs would end.
    pub(super) fn does_it(self) -> bool {
        2 * self.done >= self.tried + self.unfinished
    }

    /// Whether the unfinished runs decide it.
    pub(super) fn undecided(self) -> bool {
        !self.does_it() && 2 * (self.done + self.unfinished) >= self.tried + self.unfinished
    }
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

impl Run {
    /// A run of which nothing is known yet.
    pub(super) fn begun(case: &str, kind: EngineKind, dt_ms: f64, scene: &str, key: Option<String>) -> Self {
        Run {
            case: case.to_owned(),
            engine: kind.name().to_owned(),
            settings: kind.settings().to_owned(),
            dt_ms,
            scene: Some(scene.to_owned()),
            key,
            kept: None,
            error: None,
            invariants: Invariants::default(),
            trouble: None,
            unfinished: false,
            not_played: false,
            starts: None,
            cpu_s: 0.0,
            cpu_s_between: [0.0; 2],
            us_per_step: Times::default(),
        }
    }

    /// Whether it solves the scene, from at least half of the starts if there are many.
    pub fn does_it(&self) -> bool {
        self.starts.map_or(self.trouble.is_none(), |starts| starts.does_it())
    }

    /// Judges it again, as [`trouble`] does now and by what an adapter is known not to pass on: a run that was of no use stays so.
    pub(super) fn judge(&mut self, refused: Option<&NotPlayed>) {
        if let Some(why) = refused {
            (self.not_played, self.unfinished, self.starts) = (true, false, None);
            self.trouble = Some(why.to_string());
        }
        if let (None, Some(error)) = (&self.trouble, &self.error) {
            self.trouble = trouble(error, &self.invariants);
        }
    }

    /// The error without its sign, at least the [`floor`] of its unit, of a run that solves the scene. An
    /// error within a bound counts as none: see [`Run::judged`].
    pub fn usable_error(&self) -> Option<f64> {
        let figure = self.error.as_ref().filter(|_| self.does_it())?;
        let value = figure.value.filter(|x| x.is_finite())?;
        let size = if figure.within.is_some() { value } else { value.abs() };
        Some(size.max(floor(&figure.unit)))
    }

    /// The error as verdicts compare it: the part of the starts from which it fails, where there are many; all that stays
    /// within a bound is equal.
    pub fn judged(&self) -> Option<f64> {
        if let Some(starts) = self.starts {
            return self.does_it().then(|| 1.0 - f64::from(starts.done) / f64::from(starts.tried));
        }
        let bounded = self.error.as_ref().is_some_and(|figure| figure.within.is_some());
        self.usable_error().map(|error| if bounded { 0.0 } else { error })
    }

    /// Leaves it without times, as if it had never been timed.
    pub(super) fn forget_times(&mut self) {
        (self.cpu_s, self.cpu_s_between) = (0.0, [0.0; 2]);
        self.us_per_step = Times::default();
        if let Some(kept) = &mut self.kept {
            kept.time_factor = None;
        }
    }

    /// Multiplies its times.
    pub(super) fn scale_times(&mut self, by: f64) {
        self.cpu_s *= by;
        self.cpu_s_between = self.cpu_s_between.map(|s| s * by);
        let Times { dynamics, collision, solver, total, worst } = &mut self.us_per_step;
        for part in [dynamics, collision, solver, total, worst] {
            *part *= by;
        }
    }

    /// Whether it is more than a metre from its own fine run: the number has no meaning, there are two outcomes.
    pub(super) fn ends_otherwise(&self) -> bool {
        let figure = self.error.as_ref().filter(|figure| figure.from_own_fine_run && figure.unit == "mm");
        figure.and_then(|figure| figure.value).is_some_and(|mm| mm.abs() > OTHERWISE_MM)
    }

    /// Difference from the engine's own run at a far smaller step, if that is the figure.
    pub fn difference(&self) -> Option<f64> {
        self.error.as_ref().filter(|figure| figure.from_own_fine_run)?.value
    }
}

/// A difference from the own fine run beyond this is another outcome, mm.
pub(super) const OTHERWISE_MM: f64 = 1e3;

/// Every word once, in the order in which they come.
pub(super) fn distinct<'a>(words: impl Iterator<Item = &'a String>) -> Vec<&'a str> {
    let mut distinct: Vec<&str> = Vec::new();
    for word in words {
        if !distinct.contains(&word.as_str()) {
            distinct.push(word);
        }
    }
    distinct
}

/// Errors below this count as equal: a thousandth of a per cent, a tenth of a micrometre, a nanoradian.
pub fn floor(unit: &str) -> f64 {
    match unit {
        "rad" => 1e-9,
        "mm" => 1e-4,
        percent if percent.starts_with('%') => 1e-3,
        _ => 1e-12,
    }
}
