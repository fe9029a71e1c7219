//! How well a set of options does in its plays.

use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// How a play ended, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum End {
    /// The scene is solved.
    Solved,
    /// It would be, were bodies not too deep in each other.
    Deep,
    /// The object is lost, or a bound is broken.
    Lost,
    /// It did not end in its time.
    Unfinished,
    /// A step failed.
    Failed,
}

impl End {
    const ALL: [(End, char); 5] =
        [(End::Solved, 's'), (End::Deep, 'd'), (End::Lost, 'l'), (End::Unfinished, 'u'), (End::Failed, 'f')];

    /// Its letter in the file.
    pub(super) fn letter(self) -> char {
        Self::ALL[self as usize].1
    }

    /// That of a letter.
    pub(super) fn of_letter(letter: char) -> Option<Self> {
        Self::ALL.iter().find(|(_, its)| *its == letter).map(|(end, _)| *end)
    }
}

/// The outcome of a play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Outcome {
    pub end: End,
    /// Deepest overlap, mm; of a play that comes to nothing none.
    pub overlap_mm: Option<f64>,
}

/// The known results of a set of options.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Score {
    /// Plays that solve the scene, all that ended, and those that did not end in their time.
    pub solved: usize,
    pub of: usize,
    pub unfinished: usize,
    /// Sum of how badly all of them ended.
    bad: usize,
    overlap_mm: f64,
}

impl Score {
    pub(super) fn of(plays: &[Outcome]) -> Self {
        let unfinished = plays.iter().filter(|play| play.end == End::Unfinished).count();
        Score {
            solved: plays.iter().filter(|play| play.end == End::Solved).count(),
            of: plays.len() - unfinished,
            unfinished,
            bad: plays.iter().map(|play| play.end as usize).sum(),
            overlap_mm: plays.iter().filter_map(|play| play.overlap_mm).fold(0.0, f64::max),
        }
    }

    /// The better, the smaller, by how plays ended; of scores of equally many plays.
    pub(super) fn ends(&self, other: &Self) -> Ordering {
        other.solved.cmp(&self.solved).then(self.bad.cmp(&other.bad))
    }

    /// The same; of those that ended equally the one with the lesser overlap.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.ends(other).then(self.overlap_mm.total_cmp(&other.overlap_mm))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(plays: &[(End, f64)]) -> Score {
        let outcome = |&(end, overlap_mm)| Outcome { end, overlap_mm: Some(overlap_mm) };
        Score::of(&plays.iter().map(outcome).collect::<Vec<_>>())
    }

    #[test]
    fn solved_plays_decide_then_how_badly_the_others_end_then_the_overlap() {
        let sorted = [
            [(End::Solved, 5.0), (End::Failed, 0.0)],
            [(End::Deep, 9.0), (End::Lost, 0.0)],
            [(End::Lost, 1.0), (End::Lost, 0.0)],
            [(End::Lost, 2.0), (End::Lost, 0.0)],
            [(End::Lost, 1.0), (End::Unfinished, 0.0)],
            [(End::Unfinished, 0.0), (End::Failed, 0.0)],
        ];
        for pair in sorted.windows(2) {
            assert_eq!(score(&pair[0]).order(&score(&pair[1])), Ordering::Less, "{pair:?}");
        }
    }

    #[test]
    fn a_play_that_did_not_end_is_counted_apart() {
        let score = score(&[(End::Solved, 1.0), (End::Unfinished, 0.0), (End::Lost, 0.0)]);
        assert_eq!((score.solved, score.of, score.unfinished), (1, 2, 1));
    }

    #[test]
    fn every_end_has_its_own_letter() {
        for (end, letter) in End::ALL {
            assert_eq!((end.letter(), End::of_letter(letter)), (letter, Some(end)));
        }
        assert_eq!(End::of_letter('x'), None);
    }
}
