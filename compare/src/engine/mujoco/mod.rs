//! MuJoCo: the same scene as an MJCF document, stepped by a Python process that talks in frames of floats.

mod export;
mod mjcf;
mod settings;
mod surface;

use super::adapter::{Adapter, NotPlayed};
use super::worker::{self, Program, SharedWorker, Worker};
use anyhow::{Result, bail};
pub use export::Exported;
use mjcf::{Base, Document};
use palmares_bench::engine::{Cost, Engine};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::actuation::{base, motor};
use palmares_sim::{BaseCommand, Command, Model, Push, State};
use palmares_sim::{ContactForce, StepOutcome};
use parry3d_f64::glamx::EulerRot;
pub use settings::{FOUND, SETTINGS, SPACE, Settings};
use std::sync::Arc;

/// Its process.
const PROGRAM: Program = Program {
    engine: "MuJoCo",
    python: "PALMARES_MUJOCO_PYTHON",
    text: include_str!("../../../python/mujoco_worker.py"),
    version: "import mujoco, numpy; print(mujoco.__version__)",
};

/// The interpreter: the environment variable `PALMARES_MUJOCO_PYTHON`, or `python3`.
pub fn python() -> String {
    PROGRAM.interpreter()
}

/// The installed version of MuJoCo.
///
/// # Errors
/// No such interpreter, or it has no package `mujoco`.
pub fn version() -> Result<String> {
    PROGRAM.version()
}

/// Notes on all settings, for the report.
pub fn notes() -> Vec<String> {
    mjcf::notes()
}

/// The scene as a document with MuJoCo's own settings; none if it has no equivalent.
pub fn scene_text(model: &Model, state: &State) -> Option<String> {
    Some(mjcf::document(model, state, &SETTINGS[0])?.xml)
}

/// Lets MuJoCo play a scene under some commands, one for each step, and keeps what went into it.
///
/// # Errors
/// The scene has no MuJoCo equivalent, or MuJoCo is not there.
pub fn export(
    model: Arc<Model>,
    state: State,
    settings: &Settings,
    commands: &[Command],
) -> Result<Exported> {
    let mut engine = MuJoCo::new(model, state, settings)?;
    let (qpos, qvel) = engine.positions();
    let mut ctrl = Vec::with_capacity(commands.len());
    for command in commands {
        // From a copy of the state: the step itself also moves the motors.
        let before = engine.state.clone();
        ctrl.push(engine.control(command));
        engine.state = before;
        engine.step(command)?;
    }
    Ok(Exported { xml: engine.document.xml, qpos, qvel, ctrl })
}

/// A scene in MuJoCo.
pub(super) struct MuJoCo {
    model: Arc<Model>,
    state: State,
    worker: SharedWorker,
    document: Document,
    base: Base,
    /// World pose of the base at the joints' zero.
    start: Pose,
    touched: bool,
    /// Whether the base servo is on, and the forces from outside, as MuJoCo has them.
    servo_on: bool,
    pushes: Vec<Push>,
    outcome: StepOutcome,
}

impl MuJoCo {
    pub(super) fn new(model: Arc<Model>, state: State, settings: &Settings) -> Result<Self> {
        let document = mjcf::document(&model, &state, settings)
            .ok_or_else(|| NotPlayed("its adapter has no equivalent of this scene".into()))?;
        let worker = worker::shared(Worker::start(&PROGRAM, &document.xml)?);
        let base = Base::of(&model);
        let start = state.base;
        let outcome = StepOutcome { converged: true, ..StepOutcome::default() };
        let (touched, servo_on, pushes) = (true, true, Vec::new());
        let mujoco =
            MuJoCo { model, state, worker, document, base, start, touched, servo_on, pushes, outcome };
        let tendons = mujoco.model.hand().map_or(0, |hand| hand.tendons.len());
        let servo = if base == Base::Servo { 6 } else { 0 };
        let expected = [mujoco.positions().0.len(), mujoco.positions().1.len(), servo + tendons];
        let sizes = mujoco.worker.borrow().sizes;
        if sizes != expected {
            bail!("MuJoCo made nq, nv, nu = {sizes:?} of a scene of {expected:?}");
        }
        Ok(mujoco)
    }

    /// qpos and qvel of the state.
    fn positions(&self) -> (Vec<f64>, Vec<f64>) {
        let state = &self.state;
        let (mut q, mut v) = (Vec::new(), Vec::new());
        match self.base {
            Base::None | Base::Bolted => {}
            Base::Free => free(&state.base, &state.v[..6], &mut q, &mut v),
            Base::Servo => {
                let offset = state.base.translation - self.start.translation;
                q.extend(offset.to_array());
                q.extend(self.angles(state.base.rotation));
                v.extend(&state.v[..6]);
            }
        }
        for hinge in &self.document.hinges {
            q.push(hinge.ratio * state.q[hinge.coordinate] + hinge.offset);
            v.push(hinge.ratio * state.v[6 + hinge.coordinate]);
        }
        for (k, pose) in state.objects.iter().enumerate() {
            let at = self.model.object_dofs(k);
            free(pose, &state.v[at..at + 6], &mut q, &mut v);
        }
        (q, v)
    }

    /// Angles of the base's three hinges, which turn about the world's x, y and z in this order.
    fn angles(&self, rotation: Rotation) -> [f64; 3] {
        let (x, y, z) = (rotation * self.start.rotation.inverse()).to_euler(EulerRot::XYZ);
        [x, y, z]
    }

    /// Passes on what changes of the base servo and of the forces from outside.
    fn load(&mut self, command: &Command) -> Result<()> {
        let on = command.base != BaseCommand::Free;
        if self.base == Base::Servo && on != self.servo_on {
            self.worker.borrow_mut().write(b'B', &[&[f64::from(u8::from(on))]])?;
            self.servo_on = on;
        }
        if command.pushes != self.pushes {
            let row = |push: &Push| {
                let [point, force] = [push.point, push.force].map(|vector| vector.to_array());
                [vec![push.link as f64], point.to_vec(), force.to_vec()].concat()
            };
            let rows: Vec<f64> = command.pushes.iter().flat_map(row).collect();
            self.worker.borrow_mut().write(b'F', &[&[command.pushes.len() as f64], &rows])?;
            self.pushes.clone_from(&command.pushes);
        }
        Ok(())
    }

    fn control(&mut self, command: &Command) -> Vec<f64> {
        let config = self.model.config();
        let mut control = Vec::new();
        let Some(hand) = self.model.hand() else { return control };
        base::advance(config, self.state.base, &mut self.state.reference, &command.base);
        if self.base == Base::Servo {
            let to = &self.state.reference;
            let servo = &config.base;
            let lead = servo.damping / servo.stiffness;
            let offset = to.pose.translation - self.start.translation + to.linear * lead;
            let lead = servo.angular_damping / servo.angular_stiffness;
            let angles = Vec3::from_array(self.angles(to.pose.rotation)) + to.angular * lead;
            control.extend(offset.to_array());
            control.extend(angles.to_array());
        }
        for (i, motor) in hand.motors.iter().enumerate() {
            let sigma = command.sigma.get(i).copied().unwrap_or(self.state.motors[i].command);
            motor::advance(motor, &mut self.state.motors[i], sigma, config.step_s, |change| change);
        }
        for tendon in &hand.tendons {
            let wound = tendon.wound(&hand.motors, |motor| self.state.motors[motor].position);
            // MuJoCo clamps an actuator's force before the implicit step, at the end of which alone it is
            // meaningful. So the set point is clamped to where the tendon will be, plus what f_max stretches it.
            let mut rate = 0.0;
            tendon.gradient(&self.state.q, |c, r| rate += r * self.state.v[6 + c]);
            let ahead = tendon.length(&self.state.q) + config.step_s * rate;
            let stretch = tendon.force_limit / tendon.stiffness;
            // A clamp from below makes long steps unstable; joint springs keep a cable taut in all scenes.
            let least = if tendon.both_ways { ahead - stretch } else { f64::NEG_INFINITY };
            control.push(wound.max(least).min(ahead + stretch));
        }
        control
    }

    fn pull(&mut self, q: &[f64], v: &[f64], forces: &[f64]) {
        let mut at = (0, 0);
        let state = &mut self.state;
        match self.base {
            Base::None | Base::Bolted => {}
            Base::Free => {
                state.base = placed(&mut state.v[..6], q, v);
                at = (7, 6);
            }
            Base::Servo => {
                let turn = Rotation::from_euler(EulerRot::XYZ, q[3], q[4], q[5]);
                let offset = Vec3::new(q[0], q[1], q[2]);
                let before = self.start;
                state.base = Pose::from_parts(before.translation + offset, turn * before.rotation);
                let first = Rotation::from_rotation_x(q[3]);
                let second = first * Rotation::from_rotation_y(q[4]);
                let angular = Vec3::X * v[3] + first * Vec3::Y * v[4] + second * Vec3::Z * v[5];
                state.v[..3].copy_from_slice(&v[..3]);
                state.v[3..6].copy_from_slice(&angular.to_array());
                at = (6, 6);
            }
        }
        for (c, &master) in self.document.masters.iter().enumerate() {
            let hinge = &self.document.hinges[master];
            state.q[c] = (q[at.0 + master] - hinge.offset) / hinge.ratio;
            state.v[6 + c] = v[at.1 + master] / hinge.ratio;
        }
        let hinges = self.document.hinges.len();
        at = (at.0 + hinges, at.1 + hinges);
        for k in 0..state.objects.len() {
            let dofs = self.model.object_dofs(k);
            let (q, v) = (&q[at.0 + 7 * k..], &v[at.1 + 6 * k..]);
            state.objects[k] = placed(&mut state.v[dofs..dofs + 6], q, v);
        }
        let tendons = state.tension.len();
        state.tension.copy_from_slice(&forces[forces.len() - tendons..]);
    }
}

/// A floating body's part of qpos and qvel; MuJoCo turns about the body's own axes.
fn free(pose: &Pose, velocity: &[f64], q: &mut Vec<f64>, v: &mut Vec<f64>) {
    q.extend(pose.translation.to_array());
    let r = pose.rotation;
    q.extend([r.w, r.x, r.y, r.z]);
    v.extend(&velocity[..3]);
    let angular = r.inverse() * Vec3::new(velocity[3], velocity[4], velocity[5]);
    v.extend(angular.to_array());
}

/// The pose and velocity of a floating body from its part of qpos and qvel.
fn placed(velocity: &mut [f64], q: &[f64], v: &[f64]) -> Pose {
    let rotation = Rotation::from_xyzw(q[4], q[5], q[6], q[3]).normalize();
    let angular = rotation * Vec3::new(v[3], v[4], v[5]);
    velocity[..3].copy_from_slice(&v[..3]);
    velocity[3..6].copy_from_slice(&angular.to_array());
    Pose::from_parts(Vec3::new(q[0], q[1], q[2]), rotation)
}

impl Engine for MuJoCo {
    fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn step(&mut self, command: &Command) -> Result<Cost> {
        Adapter::MUJOCO.obeys(&self.model, command)?;
        if self.touched {
            let (q, v) = self.positions();
            self.worker.borrow_mut().push(&q, &v)?;
            self.touched = false;
        }
        self.load(command)?;
        let control = self.control(command);
        let mut worker = self.worker.borrow_mut();
        let frame = worker.step(&control)?;
        let [nq, nv, _] = worker.sizes;
        drop(worker);
        let (q, rest) = frame.numbers.split_at(nq);
        let (v, forces) = rest.split_at(nv);
        self.pull(q, v, forces);
        self.state.step += 1;
        self.outcome.penetration_m = frame.overlap_m;
        self.outcome.converged = self.state.is_finite() && frame.warnings == 0;
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
        self.worker.borrow_mut().contacts(&self.document.owners)
    }
}
