//! The order in which a search tries sets of options.

use super::plays::{End, Play};
use crate::engine::EngineKind;
use crate::engine::option_set::Dimension;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// The known results of a set of options.
#[derive(Clone, Debug, Default)]
pub(super) struct Score {
    /// Plays that solve the scene, all that ended, and those that did not end in their time, which say nothing.
    pub solved: usize,
    pub of: usize,
    pub unfinished: usize,
    /// Sum of how badly they ended.
    bad: usize,
    overlap_mm: f64,
}

impl Score {
    pub(super) fn of(plays: &[Play]) -> Self {
        let ended: Vec<&Play> = plays.iter().filter(|play| play.end != End::Unfinished).collect();
        let deepest = plays.iter().filter_map(|play| play.overlap_mm).fold(0.0, f64::max);
        Score {
            solved: plays.iter().filter(|play| play.end == End::Solved).count(),
            of: ended.len(),
            unfinished: plays.len() - ended.len(),
            bad: ended.iter().map(|play| play.end as usize).sum(),
            overlap_mm: deepest,
        }
    }

    /// The better, the smaller.
    fn order(&self, other: &Self) -> Ordering {
        // A set of which nothing is known comes last.
        let mean =
            |score: &Score| if score.of == 0 { f64::INFINITY } else { score.bad as f64 / score.of as f64 };
        let solved = other.solved.cmp(&self.solved);
        solved.then(mean(self).total_cmp(&mean(other))).then(self.overlap_mm.total_cmp(&other.overlap_mm))
    }
}

/// The sets that were tried on an engine in a scene.
pub(super) struct Climb {
    kind: EngineKind,
    scores: BTreeMap<&'static str, Score>,
    expanded: BTreeSet<&'static str>,
}

impl Climb {
    /// Begins with an engine; its settings do not matter.
    pub(super) fn new(kind: EngineKind) -> Self {
        Climb { kind, scores: BTreeMap::new(), expanded: BTreeSet::new() }
    }

    pub(super) fn known(&mut self, settings: &'static str, score: Score) {
        self.scores.insert(settings, score);
    }

    /// The sets, the best first.
    pub(super) fn ranked(&self) -> Vec<(&'static str, &Score)> {
        let mut all: Vec<_> = self.scores.iter().map(|(name, score)| (*name, score)).collect();
        all.sort_by(|a, b| a.1.order(b.1));
        all
    }

    /// The changes of the best set whose changes were not requested yet.
    pub(super) fn next(&mut self) -> Option<Vec<EngineKind>> {
        let best = self.ranked().into_iter().find(|(name, _)| !self.expanded.contains(name))?.0;
        self.expanded.insert(best);
        let best = EngineKind::from_names(self.kind.name(), Some(best)).ok()?;
        let kinds = self.kind.space().iter().flat_map(|Dimension(option, values)| {
            values.iter().filter_map(move |value| best.changed(option, value))
        });
        Some(kinds.filter(|kind| !self.scores.contains_key(kind.settings())).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn play(end: End, overlap_mm: f64) -> Play {
        let text = String::new;
        let overlap_mm = Some(overlap_mm);
        Play { scene: text(), number: 0, engine: text(), settings: text(), step_ms: 1.0, end, overlap_mm }
    }

    #[test]
    fn a_play_that_did_not_end_counts_for_no_set_and_against_none() {
        let score = Score::of(&[play(End::Solved, 1.0), play(End::Unfinished, 0.0), play(End::Lost, 0.0)]);
        assert_eq!((score.solved, score.of, score.unfinished), (1, 2, 1));
    }

    #[test]
    fn the_changes_of_the_best_set_are_tried_first_and_once() {
        let kind = EngineKind::from_names("mujoco", None).expect("it is known");
        let mut climb = Climb::new(kind);
        climb.known("default", Score::of(&[play(End::Lost, 1.0)]));
        climb.known("stiff5", Score::of(&[play(End::Deep, 9.0)]));
        climb.known("stiff2", Score::of(&[play(End::Solved, 5.0)]));
        assert_eq!(climb.ranked()[0].0, "stiff2");
        let changes = climb.next().expect("changes of stiff2");
        assert!(changes.iter().all(|kind| kind.settings().starts_with("stiff2+")), "{changes:?}");
        assert!(changes.iter().any(|kind| kind.settings() == "stiff2+multiccd=disable"));
        climb.known(changes[0].settings(), Score::of(&[play(End::Solved, 2.0)]));
        let next = climb.next().expect("changes of the better one");
        let both = "stiff2+multiccd=disable+nativeccd=disable";
        assert!(next.iter().any(|kind| kind.settings() == both), "{next:?}");
    }
}
