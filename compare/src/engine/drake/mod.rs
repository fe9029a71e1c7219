//! Drake: scenes of rigid bodies, made through the plant of its Python package and stepped by a process that talks in frames of
//! floats.

mod scene;
mod settings;

use super::worker::{self, Frame, Program, SharedWorker, Worker};
use anyhow::{Result, ensure};
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

/// The installed version of Drake.
///
/// # Errors
/// No such interpreter, or it has no package `drake`.
pub fn version() -> Result<String> {
    PROGRAM.version()
}

/// Notes on all settings, for the report.
pub fn notes() -> Vec<String> {
    [
        "`pydrake`, a `MultibodyPlant` under a `Simulator`, discrete but in `continuous`, one thread; scenes of rigid bodies alone",
        "time: that of `Simulator.AdvanceTo`, over up to 64 steps a call, in a run of its own without the pipe: queries of \
         contact, contact forces and integration; no reading of poses, contacts and overlaps",
        "friction of a pair: Drake makes 2 a b/(a + b) of two coefficients, ours is their geometric mean; the coefficients are \
         those from which Drake makes ours. Scenes in which there are none are not played",
        "not passed on, so that scenes with it are not played: hands, restitution, for which Drake has no coefficient, rolling \
         resistance, friction against spin, rounded hulls, furniture of other shapes than boxes and planes",
        "boxes without the rounding of their edges; nothing sleeps",
        "where contact is hydroelastic, spheres and capsules keep point contact, which Drake falls back to: facets would keep them \
         from rolling; facets of cylinders have edges of a quarter of their smallest size",
        "the approximation TAMSI is left out: Drake has announced its removal. Options were not searched: the search plays scenes \
         with hands",
    ]
    .map(String::from)
    .to_vec()
}

/// A scene in Drake.
pub(super) struct Drake {
    model: Arc<Model>,
    state: State,
    worker: SharedWorker,
    /// Owners of the shapes, by their numbers.
    owners: Vec<Owner>,
    /// Forces and torques of the bodies in the next step, and whether the process has others than zeros.
    loads: Vec<f64>,
    loaded: bool,
    touched: bool,
    outcome: StepOutcome,
}

impl Drake {
    pub(super) fn new(model: Arc<Model>, state: State, settings: &Settings) -> Result<Self> {
        Self::by(&PROGRAM, model, state, settings)
    }

    fn by(program: &Program, model: Arc<Model>, state: State, settings: &Settings) -> Result<Self> {
        let described = scene::described(&model, settings)?;
        let worker = worker::shared(Worker::start(program, &described.to_string())?);
        let owners = scene::owners(&model);
        let sizes = worker.borrow().sizes;
        let count = state.objects.len();
        ensure!(sizes == [7 * count, 6 * count, 0], "Drake made {sizes:?} of {count} bodies");
        let outcome = StepOutcome { converged: true, ..StepOutcome::default() };
        let loads = vec![0.0; 6 * count];
        Ok(Drake { model, state, worker, owners, loads, loaded: false, touched: true, outcome })
    }

    fn push_state(&self) -> Result<()> {
        let state = &self.state;
        let poses = state.objects.iter().flat_map(scene::numbers).collect::<Vec<_>>();
        let velocities = (0..state.objects.len()).flat_map(|k| {
            let at = self.model.object_dofs(k);
            state.v[at..at + 6].to_vec()
        });
        self.worker.borrow_mut().push(&poses, &velocities.collect::<Vec<_>>())
    }

    fn pull_state(&mut self, frame: &Frame) {
        let count = self.state.objects.len();
        let (poses, velocities) = frame.numbers.split_at(7 * count);
        for (k, (pose, velocity)) in poses.chunks_exact(7).zip(velocities.chunks_exact(6)).enumerate() {
            let rotation = Rotation::from_xyzw(pose[4], pose[5], pose[6], pose[3]).normalize();
            self.state.objects[k] = Pose::from_parts(Vec3::new(pose[0], pose[1], pose[2]), rotation);
            let at = self.model.object_dofs(k);
            self.state.v[at..at + 6].copy_from_slice(velocity);
        }
        self.state.step += 1;
        self.outcome.penetration_m = frame.overlap_m;
        self.outcome.converged = self.state.is_finite() && frame.warnings == 0;
    }
}

impl Engine for Drake {
    fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn step(&mut self, _: &Command) -> Result<Cost> {
        if self.touched {
            self.push_state()?;
            self.touched = false;
        }
        let loaded = self.loads.iter().any(|load| *load != 0.0);
        if loaded || self.loaded {
            self.worker.borrow_mut().write(b'F', &[&self.loads])?;
            self.loads.fill(0.0);
            self.loaded = loaded;
        }
        let frame = self.worker.borrow_mut().step(&[])?;
        self.pull_state(&frame);
        Ok(Cost { total_s: frame.spent_s, ..Cost::default() })
    }

    fn state(&self) -> &State {
        &self.state
    }

    fn state_mut(&mut self) -> &mut State {
        self.touched = true;
        &mut self.state
    }

    fn push(&mut self, object: usize, force: Vec3, torque: Vec3) {
        let load = force.to_array().into_iter().chain(torque.to_array());
        self.loads[6 * object..].iter_mut().zip(load).for_each(|(sum, more)| *sum += more);
    }

    fn outcome(&self) -> StepOutcome {
        self.outcome
    }

    fn contacts(&mut self) -> Result<Vec<ContactForce>> {
        self.worker.borrow_mut().contacts(&self.owners)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::adapter::NotPlayed;
    use palmares_bench::cases::{Setup, run};
    use palmares_bench::engine::limit::{self, NotFinished};
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use palmares_sim::Config;

    /// Whether Drake is there; a test without it says so.
    fn there() -> bool {
        version()
            .map_err(|why| println!("SKIP: {why:#}; PALMARES_DRAKE_PYTHON names a Python with drake"))
            .is_ok()
    }

    /// The error of a case in Drake, in its unit.
    fn error(case: &str, settings: &str, dt_s: f64) -> f64 {
        let settings = SETTINGS.iter().find(|it| it.name == settings).expect("there are such");
        let (report, _) = run(case, &Setup::new(settings, dt_s)).expect("it plays");
        report.error.value.expect("an analytic answer")
    }

    #[test]
    fn drake_stops_a_sliding_cube_near_where_coulomb_says() {
        if !there() {
            return;
        }
        let percent = error("slide_stop", "hydroelastic_margin", 2e-3);
        assert!(percent <= 1.0, "{percent} %");
    }

    /// In a continuous plant a body flies along its parabola.
    #[test]
    fn the_step_is_that_of_the_integrator_in_a_continuous_plant() {
        if !there() {
            return;
        }
        let millimetres = error("free_flight", "continuous", 4e-3);
        assert!(millimetres < 1e-6, "{millimetres} mm");
    }

    #[test]
    fn a_force_acts_on_its_body_for_one_step() {
        if !there() {
            return;
        }
        let mut model =
            Model::new(Config { gravity: Vec3::ZERO, ..Config::with_step(1e-3) }, None).expect("sound");
        let parts = || vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.05 })];
        for name in ["still", "pushed"] {
            let ball = Object::new(name, parts(), 2.0, 0.5, 0.0).expect("sound");
            model.add_object(Arc::new(ball)).expect("it fits");
        }
        let model = Arc::new(model);
        let state =
            State::at_rest(&model, Pose::IDENTITY, &[0.0, 1.0].map(|x| Pose::translation(x, 0.0, 0.0)));
        let mut drake = Drake::new(Arc::clone(&model), state, &SETTINGS[0]).expect("it starts");
        drake.push(1, Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO);
        drake.push(1, Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 0.1));
        for _ in 0..2 {
            drake.step(&Command::stay(&model, Pose::IDENTITY)).expect("it steps");
        }
        // 4 N on 2 kg for 1 ms; 0.1 N m on 2/5 of 2 kg (0.05 m)^2.
        let [still, (linear, angular)] = [0, 1].map(|k| drake.state().object_velocity(&model, k));
        assert_eq!(still, (Vec3::ZERO, Vec3::ZERO));
        assert!((linear - Vec3::new(0.0, 2e-3, 0.0)).length() < 1e-12, "{linear}");
        assert!((angular - Vec3::new(0.0, 0.0, 0.05)).length() < 1e-9, "{angular}");
    }

    #[test]
    fn scenes_with_hands_or_rebounds_are_not_played() {
        for (case, what) in [("softhand_free", "hands"), ("bounce_zeno", "restitution")] {
            let failure = run(case, &Setup::new(&SETTINGS[0], 4e-3)).map(drop).expect_err("it is refused");
            let why = NotPlayed(format!("its adapter does not pass on {what}"));
            assert_eq!(failure.downcast_ref(), Some(&why), "{case}");
        }
    }

    #[test]
    fn a_step_that_does_not_end_ends_with_the_limit_of_its_run() {
        if !there() {
            return;
        }
        let text =
            PROGRAM.text.replace("self.simulator.AdvanceTo(until, interruptible=False)", "while True: pass");
        assert_ne!(text, PROGRAM.text);
        let endless = Program { text: text.leak(), ..PROGRAM };
        let model = Arc::new(Model::new(Config::with_step(1e-3), None).expect("sound"));
        let state = State::at_rest(&model, Pose::IDENTITY, &[]);
        let failure = limit::within(0.5, || {
            let mut drake = Drake::by(&endless, Arc::clone(&model), state, &SETTINGS[0]).expect("it starts");
            drake.step(&Command::stay(&model, Pose::IDENTITY)).map(drop).expect_err("it never ends")
        });
        assert_eq!(failure.downcast_ref(), Some(&NotFinished { allowed_s: 0.5 }), "{failure:#}");
    }
}
