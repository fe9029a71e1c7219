//! Runs with all laws, and without each of those that act.

use super::subject::Subject;
use anyhow::{Result, ensure};
use palmares_sim::{Law, Laws};
use serde::{Deserialize, Serialize};

/// Steps at which everything is played, s.
pub(super) const STEPS_S: [f64; 2] = [1e-3, 4e-3];

/// A subject at one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Played {
    pub commit: String,
    /// Its name.
    pub subject: String,
    /// Whether it is a grasp.
    pub is_grasp: bool,
    /// µs: a number of a file may be off by rounding.
    pub step_us: u64,
    /// Number of steps.
    pub steps: u64,
    /// Distance to its bound as a part of it; `None` if the run fails.
    pub of_bound: Option<f64>,
    /// The runs without one law, for each law that acts.
    pub without: Vec<Without>,
}

/// A run without a law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Without {
    /// Name of the law.
    pub law: String,
    /// Steps in which the law acts.
    pub acted: u64,
    /// As of the run with all laws.
    pub of_bound: Option<f64>,
    /// CPU time of a step, as a part of that with the law.
    pub time: f64,
}

/// Step in µs.
pub(super) fn micros(dt_s: f64) -> u64 {
    (1e6 * dt_s).round() as u64
}

impl Played {
    /// Plays a subject at a step. The runs without a law and those with all laws take turns, so that both have the same machine.
    ///
    /// # Errors
    /// A run cannot be started, or two equal runs differ.
    pub(super) fn play(subject: Subject, dt_s: f64, commit: &str) -> Result<Self> {
        let mut whole = subject.play(dt_s, Laws::default())?;
        let first = whole.of_bound;
        let tally = whole.seen.tally.clone();
        let mut without = Vec::new();
        for &law in Law::ALL.iter().filter(|law| tally.acted(**law) > 0) {
            let mut laws = Laws::default();
            laws.insert(law);
            let own = subject.play(dt_s, laws)?;
            // Of grasps only the outcome counts.
            if !without.is_empty() && !subject.is_grasp() {
                whole = subject.play(dt_s, Laws::default())?;
                ensure!(whole.of_bound == first, "{} at {dt_s} s: two equal runs differ", subject.name());
            }
            let (acted, time) = (tally.acted(law), own.seen.us_per_step() / whole.seen.us_per_step());
            without.push(Without { law: law.name().to_owned(), acted, of_bound: own.of_bound, time });
        }
        Ok(Played {
            commit: commit.to_owned(),
            subject: subject.name(),
            is_grasp: subject.is_grasp(),
            step_us: micros(dt_s),
            steps: tally.steps,
            of_bound: first,
            without,
        })
    }

    /// The run without a law; `None` if the law does not act.
    pub(super) fn without(&self, law: Law) -> Option<&Without> {
        self.without.iter().find(|it| it.law == law.name())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::sweep;

    /// A made-up subject with one law.
    pub(crate) fn made_up(subject: &str, law: Law, [with, without]: [Option<f64>; 2]) -> Played {
        Played {
            commit: "abc".to_owned(),
            subject: subject.to_owned(),
            is_grasp: subject.starts_with("grasp"),
            step_us: 1000,
            steps: 100,
            of_bound: with,
            without: vec![Without { law: law.name().to_owned(), acted: 50, of_bound: without, time: 0.9 }],
        }
    }

    #[test]
    fn laws_that_act_are_left_out_one_by_one() {
        let slide = Subject::Case(sweep::scene("slide_stop").expect("a scene"));
        let played = Played::play(slide, 4e-3, "abc").expect("it is played");
        assert!(played.of_bound.is_some_and(|it| it <= 1.0) && played.steps > 100, "{played:?}");
        // A cube that moves with the velocity of the end of each step stops v h/2 too soon.
        let order = played.without(Law::ObjectOrder).expect("it acts");
        assert!(order.of_bound.is_some_and(|it| it > 1.0) && order.acted > 0, "{order:?}");
        assert!(played.without(Law::SelfContact).is_none());
    }
}
