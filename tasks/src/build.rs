//! From a task, a hand and a seed to a world at tick 0.

use crate::seed::Seed;
use crate::settle::{Built, SceneError, draw};
use crate::start;
use crate::task::Task;
use palmares_models::hand::Hand;
use std::sync::Arc;

/// Builds the scene, a function of task and seed alone, and puts the hand into it, if there is one.
///
/// # Errors
/// No sound scene was found, or the hand is in the way of it.
pub fn build(task: &Task, hand: Option<Arc<Hand>>, seed: Seed) -> Result<Built, SceneError> {
    let scene = draw(task, seed)?;
    match hand {
        Some(hand) => start::put_in(task, scene, hand),
        None => Ok(scene),
    }
}
