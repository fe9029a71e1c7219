//! Only for training: shaped rewards, and runs that differ from those of the task.
//!
//! Nothing here is reached from a server. A run's potential is read off it and changes no bit of it; a varied run is one of
//! a varied task, whose content hash is another, so that neither snapshot nor replay of it passes for one of the task.

mod grasp_centre;
mod options;
mod potential;
mod shaper;
mod varied;

pub use crate::task::Quantity;
pub use grasp_centre::grasp_centre;
pub use options::Options;
pub use potential::{Potential, Terms};
pub use shaper::Shaper;

use crate::run::Run;
use crate::seed::Seed;
use crate::sensing::Noise;
use crate::settle::SceneError;
use crate::task::Task;
use palmares_models::hand::Hand;
use std::sync::Arc;

/// Variations drawn before a run is given up: a start in which the hand touches something is drawn again.
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
    options: &Options,
) -> Result<Run, SceneError> {
    if options.vary_nothing() {
        return Ok(Run::new(Arc::clone(task), Arc::clone(hand), seed)?.with_noise(noise));
    }
    let mut last = None;
    for attempt in 0..ATTEMPTS {
        let varied = Arc::new(task.varied(seed, attempt, options));
        match Run::new(varied, Arc::clone(hand), seed) {
            Ok(run) => return Ok(run.with_noise(noise)),
            Err(why) => last = Some(why),
        }
    }
    Err(last.unwrap_or_else(|| SceneError::unsound(task, "no variation was drawn")))
}
