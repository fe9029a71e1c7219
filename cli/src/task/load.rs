//! Loads the task and the hand of an argument.

use anyhow::Context;
use palmares_models::builtin::builtin_hands;
use palmares_models::error::LoadWarning;
use palmares_models::hand::Hand;
use palmares_models::read::{self, LoadOptions, tells_of_filled_hollows};
use palmares_tasks::{SceneError, Task};
use std::path::Path;
use std::sync::Arc;

/// A task from a folder or file, or the built-in task of that name.
pub(super) fn load_task(name: &str) -> anyhow::Result<(Arc<Task>, Vec<LoadWarning>)> {
    let path = Path::new(name);
    if !path.exists() {
        let tasks = Task::builtin();
        if let Some(task) = tasks.iter().find(|task| task.name == name) {
            return Ok((task.clone(), Vec::new()));
        }
        let known: Vec<&str> = tasks.iter().map(|task| task.name.as_str()).collect();
        anyhow::bail!(
            "`{name}` is neither a folder with a task.toml nor a built-in task: {}",
            known.join(", ")
        );
    }
    let loaded = Task::load(path)?;
    Ok((Arc::new(loaded.task), loaded.warnings))
}

/// The error of a scene, with a hint if it names an object whose hollows are filled.
pub(super) fn scene_error(error: &SceneError, warnings: &[LoadWarning]) -> String {
    let mut text = error.to_string();
    for warning in warnings.iter().filter(|warning| tells_of_filled_hollows(warning)) {
        // A warning on an object of a URDF names its link.
        let named = warning.element.split('`').nth(1);
        if named.is_none_or(|name| text.contains(name)) {
            text += &format!("\nA possible cause: {}: {}", warning.element, warning.message);
        }
    }
    text
}

/// A hand from a file or folder, or the built-in hand of that name.
pub(super) fn load_hand(name: &str) -> anyhow::Result<Arc<Hand>> {
    let path = Path::new(name);
    if !path.exists()
        && let Some(hand) = Hand::builtin(name)
    {
        return Ok(hand);
    }
    let known: Vec<&str> = builtin_hands().iter().map(|hand| hand.name.as_str()).collect();
    let loaded = read::hand(path, &LoadOptions::default());
    let loaded = loaded.with_context(|| format!("built-in hands: {}", known.join(", ")))?;
    Ok(Arc::new(loaded.hand))
}
