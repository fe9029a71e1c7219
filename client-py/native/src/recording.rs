//! Replays in Python: what they say of their run, and the run as arrays.

use crate::analysis::arrays::value_error;
use crate::interrupt::{ProgressReport, interruptible_with_progress};
use crate::lookup;
use crate::state::{self, Quantity, STATE};
use numpy::{PyArray1, PyArrayMethods};
use palmares_analysis::mechanics::Mechanics;
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_replay::{self as replay, Replay, word};
use palmares_sim::Owner;
use palmares_tasks::Run;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A replay whose chain and signature are those of its bytes.
#[pyclass(module = "palmares._native", frozen)]
pub(crate) struct Recording {
    replay: Arc<Replay>,
}

/// Names of motors, fingers, tendons and objects, by their kind.
type Names = Vec<(String, Vec<String>)>;

/// The recorded numbers of a run.
struct Rows {
    hand: Arc<Hand>,
    objects: usize,
    /// The numbers of [`STATE`] of each tick, then the others.
    rows: Vec<Vec<f64>>,
}

#[pymethods]
impl Recording {
    #[new]
    fn new(py: Python<'_>, data: &[u8]) -> PyResult<Self> {
        let read = py.detach(|| replay::read(data));
        let replay = read.map_err(|error| value_error(format!("{}: {error}", error.name())))?;
        Ok(Recording { replay: Arc::new(replay) })
    }

    /// Facts of the run, as JSON.
    fn facts(&self) -> String {
        let Replay { header, outcome, key, sha256, bytes, .. } = &*self.replay;
        json!({
            "run_id": header.run_id,
            "team": header.team,
            "task": header.task,
            "hand": header.hand,
            "seed": header.seed_number,
            "noise": word(&header.noise),
            "sensing": word(&header.sensing),
            "tick_s": header.tick_s,
            "ticks": outcome.ticks,
            "score": outcome.score,
            "reason": outcome.reason.as_str(),
            "events": outcome.events,
            "state_hash": outcome.state_hash,
            "signed_by": key.to_string(),
            "bytes": bytes,
            "sha256": sha256,
        })
        .to_string()
    }

    /// Simulates the run again and returns its arrays (ticks + 1, …), and the names of motors, fingers, tendons and objects. Calls
    /// `report` with the number of ticks that are done.
    #[pyo3(signature = (tasks, report=None))]
    fn arrays<'py>(
        &self,
        py: Python<'py>,
        tasks: Vec<String>,
        report: ProgressReport<'py>,
    ) -> PyResult<(Bound<'py, PyDict>, Names)> {
        let tasks = tasks.iter().map(|path| lookup::task(path)).collect::<PyResult<Vec<_>>>()?;
        let recorded = Arc::clone(&self.replay);
        let work = move |ticks: &AtomicU64| -> Result<(Rows, Names), String> {
            let quantities: Vec<&Quantity> = STATE.iter().collect();
            let (mut rows, mut names, mut mechanics) = (None, Vec::new(), Mechanics::default());
            let mut observe = |run: &mut Run| {
                let objects = run.object_states().count();
                let kept = rows.get_or_insert_with(|| {
                    names = names_of(run);
                    Rows { hand: Arc::clone(run.hand()), objects, rows: Vec::new() }
                });
                let mut row = Vec::new();
                state::row(&quantities, run, &mut mechanics, objects, &mut row);
                add_others(run, &mut row);
                kept.rows.push(row);
                ticks.store(run.tick(), Ordering::Relaxed);
            };
            let verified = replay::verify_watched(&recorded, &tasks, Some(&mut observe));
            verified.map_err(|error| format!("{}: {error}", error.name()))?;
            Ok((rows.ok_or("the run has no tick")?, names))
        };
        let (kept, names) = interruptible_with_progress(py, &report, work)?.map_err(value_error)?;
        let Rows { hand, objects, rows } = &kept;
        let quantities: Vec<&Quantity> = STATE.iter().collect();
        let arrays = state::arrays(py, &quantities, hand, *objects, &[rows.len()], rows)?;
        let others: [(&str, Vec<usize>); 4] = [
            ("command", vec![hand.motors.len()]),
            ("finger_force", vec![hand.fingers().len(), 3]),
            ("object_force", vec![*objects, 3]),
            ("score", vec![]),
        ];
        let mut from_end: usize = others.iter().map(|(_, shape)| shape.iter().product::<usize>()).sum();
        for (name, shape) in others {
            let len = shape.iter().product::<usize>();
            let part = |row: &Vec<f64>| row[row.len() - from_end..row.len() - from_end + len].to_vec();
            let values: Vec<f64> = rows.iter().flat_map(part).collect();
            from_end -= len;
            let whole: Vec<usize> = std::iter::once(rows.len()).chain(shape).collect();
            arrays.set_item(name, PyArray1::from_vec(py, values).reshape(whole)?)?;
        }
        let time = (0..rows.len()).map(|tick| tick as f64 * self.replay.header.tick_s);
        arrays.set_item("time", PyArray1::from_vec(py, time.collect()))?;
        Ok((arrays, names))
    }
}

fn names_of(run: &Run) -> Names {
    let hand = run.hand();
    let free = run.scene().bodies.iter().filter(|body| body.free);
    [
        ("motors", hand.motors.iter().map(|motor| motor.name.clone()).collect()),
        ("tendons", hand.tendons.iter().map(|tendon| tendon.name.clone()).collect()),
        ("fingers", hand.fingers().into_iter().map(|finger| finger.name).collect()),
        ("coordinates", hand.coordinates.iter().map(|coordinate| coordinate.name.clone()).collect()),
        ("objects", free.map(|body| body.name.clone()).collect()),
    ]
    .map(|(kind, names): (&str, Vec<String>)| (kind.to_owned(), names))
    .into()
}

/// Command of each motor, force of the contacts on each finger and of the hand on each object, score.
fn add_others(run: &Run, row: &mut Vec<f64>) {
    row.extend(run.applied().hand.iter().flatten());
    let fingers = run.hand().fingers();
    let mut on_fingers = vec![Vec3::ZERO; fingers.len()];
    let mut on_objects = vec![Vec3::ZERO; run.object_states().count()];
    for contact in run.world().contact_forces() {
        for (this, other, force) in
            [(contact.b, contact.a, contact.force), (contact.a, contact.b, -contact.force)]
        {
            match (this, other) {
                (Owner::Link(link), _) => {
                    if let Some(finger) = fingers.iter().position(|finger| finger.links.contains(&link)) {
                        on_fingers[finger] += force;
                    }
                }
                (Owner::Object(object), Owner::Link(_)) => on_objects[object] += force,
                _ => {}
            }
        }
    }
    row.extend(on_fingers.iter().chain(&on_objects).flat_map(Vec3::to_array));
    row.push(run.score());
}
