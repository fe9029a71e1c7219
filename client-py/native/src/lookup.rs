//! Tasks, hands and words by the names that Python gives.

use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_models::read::{self, LoadOptions};
use palmares_tasks::run::camera_name;
use palmares_tasks::{ActionLimits, Noise, Sensing, Task};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Largest seed: every JSON reader holds it exactly.
pub(crate) const LARGEST_SEED: u64 = palmares_protocol::MAX_SAFE_INTEGER;

fn builtin_tasks() -> &'static [Arc<Task>] {
    static TASKS: OnceLock<Vec<Arc<Task>>> = OnceLock::new();
    TASKS.get_or_init(Task::builtin)
}

/// Names of the tasks that come with the program.
#[pyfunction]
pub(crate) fn tasks() -> Vec<String> {
    builtin_tasks().iter().map(|task| task.name.clone()).collect()
}

/// Names of the hands that come with the program.
#[pyfunction]
pub(crate) fn hands() -> Vec<String> {
    builtin_hands().iter().map(|hand| hand.name.clone()).collect()
}

/// Largest speed (m/s) and angular speed (rad/s) of the base.
#[pyfunction]
pub(crate) fn limits() -> (f64, f64) {
    let limits = ActionLimits::default();
    (limits.speed, limits.angular_speed)
}

/// Cameras of a task with a hand: name, width, height, range in m.
#[pyfunction]
pub(crate) fn cameras(task_name: &str, hand_name: &str) -> PyResult<Vec<(String, u32, u32, f64)>> {
    let (task, hand) = (task(task_name)?, hand(hand_name)?);
    let all = task.cameras.iter().chain(&hand.sensors.cameras);
    Ok(all.map(|camera| (camera_name(&task, camera), camera.width, camera.height, camera.far)).collect())
}

/// The task of this name.
pub(crate) fn task(name: &str) -> PyResult<Arc<Task>> {
    let found = builtin_tasks().iter().find(|task| task.name == name).cloned();
    found.ok_or_else(|| {
        PyValueError::new_err(format!("task: no task {name:?}; there are: {}", tasks().join(", ")))
    })
}

/// The hand of this name, or of the folder, archive or URDF at this path.
pub(crate) fn hand(name: &str) -> PyResult<Arc<Hand>> {
    if let Some(hand) = Hand::builtin(name) {
        return Ok(hand);
    }
    let path = Path::new(name);
    if !path.exists() {
        let known = hands().join(", ");
        let message =
            format!("hand: {name:?} is neither a hand of the program ({known}) nor a file or folder");
        return Err(PyValueError::new_err(message));
    }
    let loaded = read::hand(path, &LoadOptions::default());
    loaded
        .map(|loaded| Arc::new(loaded.hand))
        .map_err(|error| PyValueError::new_err(format!("hand: {error}")))
}

/// `sensors` or `truth`.
pub(crate) fn sensing(word: &str) -> PyResult<Sensing> {
    match word {
        "sensors" => Ok(Sensing::Sensors),
        "truth" => Ok(Sensing::Truth),
        _ => Err(PyValueError::new_err(format!("sensing: found {word:?}; wanted \"sensors\" or \"truth\""))),
    }
}

/// `none` or `real`.
pub(crate) fn noise(word: &str) -> PyResult<Noise> {
    match word {
        "none" => Ok(Noise::None),
        "real" => Ok(Noise::Real),
        _ => Err(PyValueError::new_err(format!("noise: found {word:?}; wanted \"none\" or \"real\""))),
    }
}

/// A seed that JSON can tell.
pub(crate) fn seed(seed: u64) -> PyResult<u64> {
    if seed > LARGEST_SEED {
        return Err(PyValueError::new_err(format!("seed: found {seed}; wanted 0 to 2**53 - 1")));
    }
    Ok(seed)
}
