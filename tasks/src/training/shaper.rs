//! The shaped part of rewards.

use super::potential::{Potential, Terms};
use crate::run::{Reason, Run};

/// Makes of the potential Φ the reward F = γ Φ(s') − Φ(s) of each step from s to s'.
///
/// Added to the score's change it leaves the best policies what they are (Ng, Harada and Russell 1999, "Policy invariance
/// under reward transformations"). For this Φ is 0 where a run is complete: of what an episode of n steps returns, the
/// shaped parts sum up to γⁿ Φ(sₙ) − Φ(s₀), which is −Φ(s₀) whatever was done (Grześ 2017, "Reward shaping in episodic
/// reinforcement learning"). A run that a time limit cut short is not complete: learners go on from its last state with
/// their estimate, and Φ counts there.
#[derive(Clone, Debug)]
pub struct Shaper {
    potential: Potential,
    discount: f64,
    last: f64,
    terms: Terms,
}

impl Shaper {
    /// For a run of a task that has rewards, from its present state on. `discount` is the learner's γ for a step; without
    /// it the task's.
    pub fn new(run: &Run, discount: Option<f64>) -> Option<Self> {
        let declared = run.task().training.rewards.as_ref()?;
        let discount = discount.unwrap_or(declared.discount);
        let potential = Potential::new(run)?;
        let mut shaper = Shaper { potential, discount, last: 0.0, terms: Terms::default() };
        shaper.restart(run);
        Some(shaper)
    }

    /// Forgets what was before the present state of a run of the same scene.
    pub fn restart(&mut self, run: &Run) {
        self.last = self.at(run);
    }

    /// F of the step that has led here from where it was called the last time.
    pub fn step(&mut self, run: &Run) -> f64 {
        // A failed world has no valid state.
        if run.fault().is_some() {
            return 0.0;
        }
        let before = self.last;
        self.last = self.at(run);
        self.discount * self.last - before
    }

    /// The terms of Φ when it was last looked at; none of them where the run is complete.
    pub fn terms(&self) -> Terms {
        self.terms
    }

    fn at(&mut self, run: &Run) -> f64 {
        let complete = run.over() == Some(Reason::Complete);
        self.terms = if complete { Terms::default() } else { self.potential.at(run) };
        self.terms.sum()
    }
}
