//! What is worse, and what is better, without a law.

use super::played::{Played, Without};
use palmares_sim::Law;

/// A distance changes if it is multiplied or divided by more than this.
pub(super) const FACTOR: f64 = 2.0;
/// Distances below this part of the bound are rounding errors.
pub(super) const LEAST: f64 = 0.01;

/// A case whose distance changes: its name, and the distance with and without the law. `None` is a run that fails.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Change {
    pub subject: String,
    pub with: Option<f64>,
    pub without: Option<f64>,
}

impl Change {
    /// Distance without, as a multiple of that with.
    fn times(&self) -> f64 {
        distance(self.without) / distance(self.with).max(LEAST)
    }
}

/// A law at one step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Finding {
    pub law: Law,
    /// Number of cases, and of those in which the law acts.
    pub cases: usize,
    pub acts: usize,
    /// Median of the CPU time of a step without it, as a part of that with it, over the cases in which it acts.
    pub time: Option<f64>,
    /// Cases that go beyond their bound, the farthest first.
    pub beyond: Vec<Change>,
    /// Cases that stay on their side of the bound, with a larger distance.
    pub farther: Vec<Change>,
    /// Cases with a smaller distance.
    pub nearer: Vec<Change>,
    /// Number of grasps, of those kept with the law, and without it.
    pub grasps: usize,
    pub kept: [usize; 2],
}

fn distance(of_bound: Option<f64>) -> f64 {
    of_bound.unwrap_or(f64::INFINITY)
}

impl Finding {
    /// The finding of a law in runs at one step.
    pub(super) fn of(law: Law, played: &[&Played]) -> Self {
        let (grasps, cases): (Vec<&Played>, Vec<&Played>) = played.iter().partition(|it| it.is_grasp);
        let without: Vec<(&Played, &Without)> =
            cases.iter().filter_map(|it| it.without(law).map(|without| (*it, without))).collect();
        let mut times: Vec<f64> = without.iter().map(|(_, it)| it.time).filter(|it| it.is_finite()).collect();
        times.sort_by(f64::total_cmp);
        let (mut beyond, mut farther, mut nearer) = (Vec::new(), Vec::new(), Vec::new());
        for (whole, own) in &without {
            let (with, left) = (distance(whole.of_bound), distance(own.of_bound));
            let change =
                Change { subject: whole.subject.clone(), with: whole.of_bound, without: own.of_bound };
            if with <= 1.0 && left > 1.0 {
                beyond.push(change);
            } else if left >= LEAST && left > FACTOR * with {
                farther.push(change);
            } else if with >= LEAST && with > FACTOR * left {
                nearer.push(change);
            }
        }
        for list in [&mut beyond, &mut farther] {
            list.sort_by(|a, b| b.times().total_cmp(&a.times()));
        }
        nearer.sort_by(|a, b| a.times().total_cmp(&b.times()));
        let kept = |of_bound: Option<f64>| usize::from(of_bound.is_some());
        let kept_without = |it: &Played| kept(it.without(law).map_or(it.of_bound, |own| own.of_bound));
        Finding {
            law,
            cases: cases.len(),
            acts: without.len(),
            time: times.get(times.len() / 2).copied(),
            beyond,
            farther,
            nearer,
            grasps: grasps.len(),
            kept: [
                grasps.iter().map(|it| kept(it.of_bound)).sum(),
                grasps.iter().map(|it| kept_without(it)).sum(),
            ],
        }
    }

    /// Whether it acts in no case and changes no grasp.
    pub(super) fn idle(&self) -> bool {
        self.acts == 0 && self.kept[0] == self.kept[1]
    }

    /// Whether something is worse without the law.
    pub(super) fn buys(&self) -> bool {
        !self.beyond.is_empty() || !self.farther.is_empty() || self.kept[1] < self.kept[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::played::tests::made_up;

    #[test]
    fn changes_are_told_by_the_bound_and_by_their_size() {
        let law = Law::Patches;
        let runs = [
            made_up("fails", law, [Some(0.5), None]),
            made_up("crosses", law, [Some(0.9), Some(1.1)]),
            made_up("farther", law, [Some(0.1), Some(0.3)]),
            made_up("rounding", law, [Some(1e-6), Some(1e-3)]),
            made_up("nearer", law, [Some(2.0), Some(0.5)]),
            made_up("another law", Law::Sleep, [Some(0.5), None]),
            made_up("grasp that is lost", law, [Some(0.0), None]),
            made_up("grasp that is won", law, [None, Some(0.0)]),
            made_up("grasp of another law", Law::Sleep, [Some(0.0), None]),
        ];
        let finding = Finding::of(law, &runs.iter().collect::<Vec<_>>());
        let names = |list: &[Change]| list.iter().map(|it| it.subject.clone()).collect::<Vec<_>>();
        assert_eq!(names(&finding.beyond), ["fails", "crosses"]);
        assert_eq!(names(&finding.farther), ["farther"]);
        assert_eq!(names(&finding.nearer), ["nearer"]);
        assert_eq!((finding.cases, finding.acts, finding.time), (6, 5, Some(0.9)));
        assert_eq!((finding.grasps, finding.kept), (3, [2, 2]));
        assert!(finding.buys() && !Finding::of(Law::Anchors, &[&runs[0]]).buys());
    }
}
