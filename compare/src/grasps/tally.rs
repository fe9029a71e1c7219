//! Counts: how many grasps are kept, how sure that is, and how often the outcome changes with the step.

use super::run::Run;
use crate::trials::play::Ending;
use serde::{Deserialize, Serialize};
use std::ops::Add;

/// Half width of the interval with 95 % of a normal distribution, in standard deviations.
const Z: f64 = 1.959_963_984_540_054;

/// Bounds of a proportion at 95 % (Wilson 1927).
pub fn wilson(kept: usize, of: usize) -> [f64; 2] {
    if of == 0 {
        return [0.0, 1.0];
    }
    let n = of as f64;
    let p = kept as f64 / n;
    let square = Z * Z / n;
    let middle = (p + 0.5 * square) / (1.0 + square);
    let half = Z / (1.0 + square) * libm::sqrt(p * (1.0 - p) / n + 0.25 * square / n);
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

/// Outcomes of an engine with a family at one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// Grasps kept.
    pub kept: usize,
    /// Grasps that would be kept if they were not too deep in the hand.
    pub overlapping: usize,
    /// Grasps that diverged.
    pub diverged: usize,
    /// Runs that took too long: they say nothing, and are not counted.
    pub not_finished: usize,
    /// Grasps with objects that the engine's adapter does not pass on: they are not counted, either.
    #[serde(default)]
    pub not_played: usize,
    /// Grasps that were played to an end.
    pub of: usize,
}

impl Count {
    /// Counts the runs.
    pub fn of<'a>(runs: impl Iterator<Item = &'a Run>) -> Self {
        let mut count = Count::default();
        for run in runs {
            let ending = run.fate.ending;
            match ending {
                Ending::NotFinished => count.not_finished += 1,
                Ending::NotPlayed => count.not_played += 1,
                _ => count.of += 1,
            }
            count.kept += usize::from(ending == Ending::Kept);
            count.overlapping += usize::from(ending == Ending::Overlapping);
            count.diverged += usize::from(ending == Ending::Diverged);
        }
        count
    }
}

impl Add for Count {
    type Output = Count;
    fn add(self, other: Count) -> Count {
        Count {
            kept: self.kept + other.kept,
            overlapping: self.overlapping + other.overlapping,
            diverged: self.diverged + other.diverged,
            not_finished: self.not_finished + other.not_finished,
            not_played: self.not_played + other.not_played,
            of: self.of + other.of,
        }
    }
}

/// Changes from kept to lost, or the other way round, when the step changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flips {
    /// Changes from one step to the next longer one.
    pub flips: usize,
    /// Pairs of steps that were looked at.
    pub pairs: usize,
    /// Grasps that are kept at some steps and lost at others.
    pub grasps: usize,
    /// Grasps that were played at more than one step.
    pub of: usize,
}

impl Flips {
    /// Counts the outcomes at several steps, each in the order of the draw: k kept, n not finished, x not played.
    pub fn of_endings(by_step: &[&str]) -> Self {
        let grasps = by_step.iter().map(|endings| endings.len()).min().unwrap_or(0);
        let mut flips = Flips::default();
        for grasp in 0..grasps {
            let at = |endings: &&str| endings.as_bytes()[grasp];
            let kept: Vec<bool> =
                by_step.iter().map(at).filter(|it| !matches!(it, b'n' | b'x')).map(|it| it == b'k').collect();
            if kept.len() > 1 {
                let changes = kept.windows(2).filter(|pair| pair[0] != pair[1]).count();
                let one =
                    Flips { flips: changes, pairs: kept.len() - 1, grasps: usize::from(changes > 0), of: 1 };
                flips = flips + one;
            }
        }
        flips
    }

    /// Flips out of the pairs, %.
    pub fn percent(&self) -> f64 {
        100.0 * self.flips as f64 / self.pairs.max(1) as f64
    }
}

impl Add for Flips {
    type Output = Flips;
    fn add(self, other: Flips) -> Flips {
        Flips {
            flips: self.flips + other.flips,
            pairs: self.pairs + other.pairs,
            grasps: self.grasps + other.grasps,
            of: self.of + other.of,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trials::play::Fate;

    fn run(index: usize, step_ms: f64, ending: Ending) -> Run {
        let fate = Fate { ending, end_s: 6.0, overlap_mm: 0.0, moved_mm: 0.0 };
        let text = |text: &str| text.to_owned();
        Run {
            hand: text("softhand"),
            family: text("box"),
            index,
            engine: text("own"),
            settings: text("default"),
            step_ms,
            aside_um: 0.0,
            scene: String::new(),
            key: None,
            fate,
            wall_s: 0.0,
        }
    }

    #[test]
    fn wilsons_interval_is_that_of_the_textbooks() {
        // Newcombe 1998, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
        for (kept, of, expected) in [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
        ] {
            for (bound, expected) in wilson(kept, of).into_iter().zip(expected) {
                assert!((bound - expected).abs() < 5.1e-5, "{kept} of {of}: {bound} is not {expected}");
            }
        }
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
    }

    #[test]
    fn flips_are_counted_between_neighbouring_steps_of_runs_that_ended() {
        let alike = Flips::of_endings(&["okk", "skk", "kkk", "knk"]);
        assert_eq!(alike, Flips { flips: 1, pairs: 8, grasps: 1, of: 3 });
    }

    #[test]
    fn a_run_that_is_not_finished_is_not_counted() {
        let endings = [Ending::Kept, Ending::LostShaken, Ending::Overlapping, Ending::NotFinished];
        let runs = endings.map(|ending| run(0, 1.0, ending));
        let count = Count::of(runs.iter());
        assert_eq!(
            count,
            Count { kept: 1, overlapping: 1, diverged: 0, not_finished: 1, not_played: 0, of: 3 }
        );
    }
}
