//! The file `task.toml`: a task that is read can be played, or says why not.

use crate::hand;
use crate::parts::Seeds;
use palmares_models::hand::Hand;
use palmares_tasks::Task;
use std::sync::Arc;

pub(crate) fn run(data: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(data) else { return false };
    let Ok(task) = Task::parse("task.toml", text) else { return false };
    // A fuzzer has no time for scenes of many objects and for long ticks.
    if task.objects.count <= 3 && task.steps_per_tick() <= 20 {
        hand::play(Arc::new(task), Hand::builtin("pinch").expect("a built-in hand"));
    }
    true
}

pub(crate) fn seeds() -> Seeds {
    let mut seeds: Seeds = ["balls", "shelf", "grasp", "pan", "peg"]
        .iter()
        .filter_map(|name| Some((format!("{name}.toml"), Task::builtin_toml(name)?.as_bytes().to_vec())))
        .collect();
    seeds.push(("cube.toml".into(), hand::TASK.into()));
    seeds
}
