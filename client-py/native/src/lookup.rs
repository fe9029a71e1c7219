//! Tasks, hands and words by the names that Python gives.

use crate::kept::Kept;
use crate::message;
use palmares_models::builtin::builtin_hands;
use palmares_models::catalogue::Catalogue;
use palmares_models::hand::Hand;
use palmares_models::read::{self, LoadOptions};
use palmares_protocol::Reply;
use palmares_protocol::reply::{Competition, HandInfo, Limits, TaskInfo, Welcome};
use palmares_protocol::specs::Specs;
use palmares_tasks::{Fault, Noise, Scenes, Sensing, Task};
use pyo3::exceptions::{PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::collections::BTreeMap;
use std::ffi::CString;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Largest seed: every JSON reader holds it exactly.
pub(crate) const LARGEST_SEED: u64 = palmares_protocol::MAX_SAFE_INTEGER;

/// Names of the objects of the catalogue.
#[pyfunction]
pub(crate) fn objects() -> Vec<String> {
    Catalogue::builtin().items().iter().map(|item| item.object.name.clone()).collect()
}

fn builtin_tasks() -> &'static [Arc<Task>] {
    static TASKS: OnceLock<Vec<Arc<Task>>> = OnceLock::new();
    TASKS.get_or_init(Task::builtin)
}

/// A server's answer to a client's hello, for runs in this process: the message `welcome`, with the tasks and
/// hands of the program and those of one's own at these paths.
#[pyfunction]
pub(crate) fn welcome(
    py: Python<'_>,
    team: String,
    own_hands: Vec<String>,
    own_tasks: Vec<String>,
) -> PyResult<Bound<'_, PyBytes>> {
    let own_tasks = own_tasks.iter().map(|path| task(path)).collect::<PyResult<Vec<_>>>()?;
    let own = own_hands.iter().map(|path| hand(path)).collect::<PyResult<Vec<_>>>()?;
    let hands = builtin_hands().iter().chain(&own).map(|hand| HandInfo::of(hand)).collect();
    let welcome = Welcome {
        id: 0,
        session_id: String::new(),
        resume_token: String::new(),
        team,
        session_left_s: None,
        competition: Competition {
            name: "in this process".into(),
            mode: "practice".into(),
            session_s: None,
            reset_cost_s: 0.0,
            noise: Noise::None,
            sensors_only: Vec::new(),
            hand_spread: false,
            scenes: Scenes::default(),
        },
        server: palmares::version(),
        // Nothing goes over a wire.
        limits: Limits {
            message_bytes: usize::MAX,
            repeat: u32::MAX,
            requests_per_s: f64::INFINITY,
            requests_burst: f64::INFINITY,
            resume_grace_s: f64::INFINITY,
            ping_interval_s: f64::INFINITY,
            ping_timeout_s: f64::INFINITY,
            hello_timeout_s: f64::INFINITY,
            hold_ticks: u32::MAX,
            outbox_obs: usize::MAX,
        },
        tasks: builtin_tasks().iter().chain(&own_tasks).map(|task| TaskInfo::of(task)).collect(),
        hands,
        specs: Specs::default(),
        run: None,
        note: None,
    };
    message::of(py, 0, Ok(Reply::Welcome(Box::new(welcome))))
}

/// The faults of a world: code, meaning and advice.
#[pyfunction]
pub(crate) fn faults() -> Vec<(&'static str, String)> {
    Fault::ALL.iter().map(|fault| (fault.code(), fault.in_words())).collect()
}

/// The engine's fingerprint, and the content hashes of the hands and tasks that come with the program, by name.
#[pyfunction]
pub(crate) fn identity() -> (String, BTreeMap<String, String>, BTreeMap<String, String>) {
    let hands = builtin_hands().iter().map(|hand| (hand.name.clone(), hand.content_hash()));
    let tasks = builtin_tasks().iter().map(|task| (task.name.clone(), task.content_hash().to_owned()));
    // pyo3 makes a module of the function's name.
    (palmares_tasks::identity::fingerprint(), hands.collect(), tasks.collect())
}

/// A hand in full, as JSON, like `GET /v1/hands/{name}`.
#[pyfunction]
pub(crate) fn describe_hand(name: &str) -> PyResult<String> {
    serde_json::to_string(&hand(name)?.describe()).map_err(|error| PyRuntimeError::new_err(error.to_string()))
}

fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

/// The task of this name, or of the folder or `task.toml` at this path.
pub(crate) fn task(name: &str) -> PyResult<Arc<Task>> {
    if let Some(task) = builtin_tasks().iter().find(|task| task.name == name) {
        return Ok(task.clone());
    }
    let path = Path::new(name);
    if !path.exists() {
        let known = names(builtin_tasks().iter().map(|task| task.name.as_str()));
        let message = format!(
            "task: {name:?} is neither a task of the program ({known}) nor a folder with a task.toml"
        );
        return Err(PyValueError::new_err(message));
    }
    static KEPT: Kept<(Arc<Task>, Arc<[String]>)> = Kept::new();
    let read = || {
        let loaded = Task::load(path).map_err(|error| PyValueError::new_err(format!("task: {error}")))?;
        let warnings = loaded.warnings.iter().map(ToString::to_string).collect();
        Ok::<_, PyErr>((Arc::new(loaded.task), warnings))
    };
    let (task, warnings) = KEPT.read(path, read)?;
    for warning in warnings.iter() {
        let text = CString::new(warning.replace('\0', "")).unwrap_or_default();
        Python::attach(|py| PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 2))?;
    }
    Ok(task)
}

/// The hand of this name, or of the folder, archive or URDF at this path.
pub(crate) fn hand(name: &str) -> PyResult<Arc<Hand>> {
    if let Some(hand) = Hand::builtin(name) {
        return Ok(hand);
    }
    let path = Path::new(name);
    if !path.exists() {
        let known = names(builtin_hands().iter().map(|hand| hand.name.as_str()));
        let message =
            format!("hand: {name:?} is neither a hand of the program ({known}) nor a file or folder");
        return Err(PyValueError::new_err(message));
    }
    static KEPT: Kept<Arc<Hand>> = Kept::new();
    let read = || read::hand(path, &LoadOptions::default()).map(|loaded| Arc::new(loaded.hand));
    KEPT.read(path, read).map_err(|error| PyValueError::new_err(format!("hand: {error}")))
}

/// The error about a word that is not one of the known.
pub(crate) fn one_of(name: &str, found: &str, wanted: &str) -> PyErr {
    PyValueError::new_err(format!("{name}: found {found:?}; wanted {wanted}"))
}

/// `sensors` or `truth`.
pub(crate) fn sensing(word: &str) -> PyResult<Sensing> {
    match word {
        "sensors" => Ok(Sensing::Sensors),
        "truth" => Ok(Sensing::Truth),
        _ => Err(one_of("sensing", word, "\"sensors\" or \"truth\"")),
    }
}

/// `none` or `real`.
pub(crate) fn noise(word: &str) -> PyResult<Noise> {
    match word {
        "none" => Ok(Noise::None),
        "real" => Ok(Noise::Real),
        _ => Err(one_of("noise", word, "\"none\" or \"real\"")),
    }
}

/// Checks that JSON can represent a seed.
pub(crate) fn seed(seed: u64) -> PyResult<u64> {
    if seed > LARGEST_SEED {
        return Err(PyValueError::new_err(format!("seed: found {seed}; wanted 0 to 2**53 - 1")));
    }
    Ok(seed)
}
