//! Drake: scenes of rigid bodies, made through the plant of its Python package and stepped by a process that talks in frames of
//! floats.

mod scene;
mod settings;

use super::NotPlayed;
use super::worker::{self, Frame, Program, SharedWorker, Touch, Worker};
use anyhow::{Context, Result, ensure};
use palmares_bench::engine::{Cost, Engine};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, ContactForce, Model, Owner, State, StepOutcome};
pub use settings::{SETTINGS, Settings};
use std::sync::Arc;

/// Its process.
const PROGRAM: Program = Program {
    engine: "Drake",
    python: "PALMARES_DRAKE_PYTHON",
    text: include_str!("../../../python/drake_worker.py"),
    version: "import pydrake.common, importlib.metadata as m; print(m.version('drake'))",
};

/// Its installed version.
///
/// # Errors
/// No such interpreter, or it has no package `drake`.
pub fn version() -> Result<String> {
    PROGRAM.version()
}

/// Notes on all settings, for the report.
pub fn notes() -> Vec<String> {
    [
        "`pydrake`, a discrete `MultibodyPlant`, one thread; scenes of rigid bodies alone",
        "coefficients of friction from which Drake's rule for pairs makes ours",
        "boxes without the rounding of their edges",
        "fixed bodies are rigid, free ones compliant hydroelastic, in all settings but `point`",
    ]
    .map(String::from)
    .to_vec()
}

/// A scene in Drake.
pub(super) struct Drake {
    model: Arc<Model>,
    state: State,
    worker: SharedWorker,
    owners: Vec<Owner>,
    touched: bool,
    outcome: StepOutcome,
}

impl Drake {
    pub(super) fn new(model: Arc<Model>, state: State, settings: &Settings) -> Result<Self> {
        if model.hand().is_some() {
            return Err(NotPlayed("its adapter plays rigid bodies alone".into()).into());
        }
        let described = scene::described(&model, settings)?;
        let worker = worker::shared(Worker::start(&PROGRAM, &described.to_string())?);
        let owners = scene::owners(&model);
        let sizes = worker.borrow().sizes;
        let count = state.objects.len();
        ensure!(sizes == [7 * count, 6 * count, 0], "Drake made {sizes:?} of {count} bodies");
        let outcome = StepOutcome { converged: true, ..StepOutcome::default() };
        Ok(Drake { model, state, worker, owners, touched: true, outcome })
    }

    fn push(&self) -> Result<()> {
        let state = &self.state;
        let poses = state.objects.iter().flat_map(|pose| {
            let (p, q) = (pose.translation, pose.rotation);
            [p.x, p.y, p.z, q.w, q.x, q.y, q.z]
        });
        let velocities = (0..state.objects.len()).flat_map(|k| {
            let at = self.model.object_dofs(k);
            state.v[at..at + 6].to_vec()
        });
        self.worker.borrow_mut().push(&poses.collect::<Vec<_>>(), &velocities.collect::<Vec<_>>())
    }

    fn pull(&mut self, frame: &Frame) {
        let count = self.state.objects.len();
        let (poses, velocities) = frame.numbers.split_at(7 * count);
        for (k, (pose, velocity)) in poses.chunks_exact(7).zip(velocities.chunks_exact(6)).enumerate() {
            let rotation = Rotation::from_xyzw(pose[4], pose[5], pose[6], pose[3]).normalize();
            self.state.objects[k] = Pose::from_parts(Vec3::new(pose[0], pose[1], pose[2]), rotation);
            let at = self.model.object_dofs(k);
            self.state.v[at..at + 6].copy_from_slice(velocity);
        }
    }
}

impl Engine for Drake {
    fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn step(&mut self, _: &Command) -> Result<Cost> {
        if self.touched {
            self.push()?;
            self.touched = false;
        }
        let frame = self.worker.borrow_mut().step(&[])?;
        self.pull(&frame);
        self.state.step += 1;
        self.outcome.penetration_m = frame.overlap_m;
        self.outcome.converged = self.state.is_finite();
        Ok(Cost { total_s: frame.spent_s, ..Cost::default() })
    }

    fn state(&self) -> &State {
        &self.state
    }

    fn state_mut(&mut self) -> &mut State {
        self.touched = true;
        &mut self.state
    }

    fn outcome(&self) -> StepOutcome {
        self.outcome
    }

    fn contacts(&mut self) -> Result<Vec<ContactForce>> {
        let touches = self.worker.borrow_mut().contacts()?;
        let owner = |number: f64| {
            let known = self.owners.get(number as usize).copied();
            known.context("Drake reported a shape that the scene does not have")
        };
        touches.iter().map(|touch: &Touch| worker::force(touch, owner)).collect()
    }
}
