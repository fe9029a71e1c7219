//! Only for training: shaped rewards, and runs that differ from those of the task.
//!
//! A server uses nothing of this. Computing the potential of a run does not change the run. A varied run belongs to a varied
//! task with a content hash of its own, so that neither its snapshots nor its replays are accepted as those of the task.

mod grasp_centre;
mod options;
mod potential;
mod shaper;
mod varied;

pub use crate::task::{ActionErrors, Given, Quantity};
pub use grasp_centre::grasp_centre;
pub use options::TrainingOptions;
pub use potential::{Potential, Terms};
pub use shaper::Shaper;

use crate::run::Run;
use crate::seed::Seed;
use crate::sensing::Noise;
use crate::settle::SceneError;
use crate::task::{Task, Variation};
use palmares_models::hand::Hand;
use std::sync::Arc;

/// Variations drawn before a run is given up: a variation without a sound scene is drawn again.
const ATTEMPTS: u64 = 20;

/// A run of the task with these options: a function of task, hand, seed and options. With options that vary nothing it is
/// the task's own run.
///
/// # Errors
/// There is no sound scene, or the hand overlaps something where it starts, in every variation that was drawn.
pub fn open(
    task: &Arc<Task>,
    hand: &Arc<Hand>,
    seed: Seed,
    noise: Noise,
    options: &TrainingOptions,
) -> Result<Run, SceneError> {
    if options.vary_nothing() {
        return Ok(Run::new(Arc::clone(task), Arc::clone(hand), seed)?.with_noise(noise));
    }
    let hand = options.hand_of(hand, seed).map_err(|problem| SceneError::unsound(task, problem))?;
    let mut last = None;
    for attempt in 0..ATTEMPTS {
        let varied = Arc::new(task.varied(seed, attempt, options));
        match Run::new(varied, Arc::clone(&hand), seed) {
            Ok(run) => return Ok(run.with_noise(noise)),
            Err(why) => last = Some(why),
        }
    }
    Err(last.unwrap_or_else(|| SceneError::unsound(task, "no variation was drawn")))
}

/// Factors of mass, friction and size of every object of a run.
pub fn factors(run: &Run) -> Vec<[f64; 3]> {
    let variation = run.task().variation();
    let factors = |k| variation.map_or([1.0; 3], |variation| variation.factors(k));
    (0..run.object_states().count()).map(factors).collect()
}

/// Factors of mass and inertia of every link of a run's hand.
pub fn link_factors(run: &Run) -> Vec<f64> {
    let given = run.task().variation().and_then(Variation::link_mass);
    given.map_or_else(|| vec![1.0; run.hand().links.len()], <[f64]>::to_vec)
}

/// The factor of the sensors' errors in a run.
pub fn sensor_noise(run: &Run) -> f64 {
    run.task().variation().map_or(1.0, Variation::sensor_noise)
}

#[cfg(test)]
mod tests;
