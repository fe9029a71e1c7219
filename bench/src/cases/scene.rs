//! Scenes of free bodies and furniture, and the mechanics their cases are judged by.

use super::setup::{Setup, steps};
use crate::engine::{Engine, RIGID};
use anyhow::Result;
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Vec3};
use palmares_sim::{Command, Config, Model, State};
use std::sync::Arc;

/// Gravity of a case without another value, m/s².
pub(crate) const G: f64 = 9.81;

/// Our constants without sleep: a sleeping body would hide creep and loss of speed, which these cases
/// measure.
pub(crate) fn awake(dt_s: f64) -> Config {
    Config { sleeping: false, ..Config::with_step(dt_s) }
}

/// Our constants without sleep, with contacts as stiff as those of rigid bodies.
pub(crate) fn rigid(dt_s: f64) -> Config {
    Config { contact_stiffness: RIGID, anchor_stiffness: RIGID, ..awake(dt_s) }
}

/// The same without gravity.
pub(crate) fn weightless(dt_s: f64) -> Config {
    Config { gravity: Vec3::ZERO, ..awake(dt_s) }
}

/// Gravity in the frame of a plane that is tilted by atan(`tan`) down the x axis.
pub(crate) fn tilted(config: Config, tan: f64) -> Config {
    let cos = 1.0 / (1.0 + tan * tan).sqrt();
    Config { gravity: Vec3::new(G * cos * tan, 0.0, -G * cos), ..config }
}

/// A box without rounding, from its edge lengths.
pub(crate) fn cuboid(x: f64, y: f64, z: f64) -> Shape {
    Shape::Box { half_extents: [0.5 * x, 0.5 * y, 0.5 * z], rounding: 0.0 }
}

/// Furniture and free bodies about to be put under an engine.
pub(crate) struct SceneBuilder {
    model: Model,
    base: Pose,
    poses: Vec<Pose>,
}

impl SceneBuilder {
    /// Nothing yet.
    pub(crate) fn new(config: Config) -> Result<Self> {
        Ok(SceneBuilder { model: Model::new(config, None)?, base: Pose::IDENTITY, poses: Vec::new() })
    }

    /// A hand alone, its base at `base`.
    pub(crate) fn with_hand(config: Config, hand: Arc<Hand>, base: Pose) -> Result<Self> {
        Ok(SceneBuilder { model: Model::new(config, Some(hand))?, base, poses: Vec::new() })
    }

    /// A wide plate whose top is z = 0.
    pub(crate) fn floor(self, friction: f64) -> Result<Self> {
        self.fixed(&cuboid(40.0, 40.0, 0.1), Pose::translation(0.0, 0.0, -0.05), friction)
    }

    /// A ground without end at z = 0.
    pub(crate) fn ground(mut self, friction: f64) -> Self {
        self.model.add_ground(0.0, friction);
        self
    }

    /// A fixed shape.
    pub(crate) fn fixed(mut self, shape: &Shape, pose: Pose, friction: f64) -> Result<Self> {
        self.model.add_static("furniture", shape, pose, friction)?;
        Ok(self)
    }

    /// A free body.
    pub(crate) fn body(self, shape: Shape, mass: f64, friction: f64, pose: Pose) -> Result<Self> {
        let name = format!("body {}", self.poses.len());
        self.object(Object::new(name, vec![(Pose::IDENTITY, shape)], mass, friction, 0.0)?, pose)
    }

    /// A free body, described in full.
    pub(crate) fn object(mut self, object: Object, pose: Pose) -> Result<Self> {
        self.model.add_object(Arc::new(object))?;
        self.poses.push(pose);
        Ok(self)
    }

    /// Puts it under the engine of `setup`, at rest.
    pub(crate) fn start(self, setup: &Setup) -> Result<(Box<dyn Engine>, Command)> {
        let state = State::at_rest(&self.model, self.base, &self.poses);
        let command = Command::stay(&self.model, self.base);
        Ok((setup.start(self.model, state)?, command))
    }
}

/// Runs a scene until it rests before a case begins, unrecorded.
pub(crate) fn settle(engine: &mut dyn Engine, command: &Command, time_s: f64) -> Result<()> {
    let count = steps(time_s, engine.model().config().step_s);
    (0..count).try_for_each(|_| engine.step(command).map(drop))
}

/// Linear velocity of the centre of mass and angular velocity of a body.
pub(crate) fn velocity(engine: &dyn Engine, body: usize) -> (Vec3, Vec3) {
    engine.state().object_velocity(engine.model(), body)
}

/// Speed of the fastest object, or of the hand's base, m/s.
pub(crate) fn fastest(engine: &dyn Engine) -> f64 {
    let objects = (0..engine.model().objects().len()).map(|k| velocity(engine, k).0.length());
    let base = engine.model().hand().map(|_| Vec3::from_slice(&engine.state().v[..3]).length());
    objects.chain(base).fold(0.0, f64::max)
}

/// Sets the velocities of a body.
pub(crate) fn set_velocity(engine: &mut dyn Engine, body: usize, linear: Vec3, angular: Vec3) {
    let at = engine.model().object_dofs(body);
    let v = &mut engine.state_mut().v[at..at + 6];
    v[..3].copy_from_slice(&linear.to_array());
    v[3..].copy_from_slice(&angular.to_array());
}

/// Applies a force to a body during the next step at `arm` from the centre of mass, in the world's axes.
pub(crate) fn push(engine: &mut dyn Engine, body: usize, force: Vec3, arm: Vec3) {
    engine.push(body, force, arm.cross(force));
}

/// Gives a body the impulse of a force over the next step at once.
pub(crate) fn kick(engine: &mut dyn Engine, body: usize, force: Vec3) {
    let model = engine.model();
    let change = force * (model.config().step_s / model.objects()[body].mass);
    let (linear, angular) = velocity(engine, body);
    set_velocity(engine, body, linear + change, angular);
}

/// Angular momentum about a body's own centre of mass.
pub(crate) fn spin(engine: &dyn Engine, body: usize) -> Vec3 {
    let turn = Mat3::from_quat(engine.state().objects[body].rotation);
    turn * (engine.model().objects()[body].inertia * (turn.transpose() * velocity(engine, body).1))
}

/// Kinetic energy of a body, J.
pub(crate) fn kinetic(engine: &dyn Engine, body: usize) -> f64 {
    let (linear, angular) = velocity(engine, body);
    0.5 * engine.model().objects()[body].mass * linear.length_squared()
        + 0.5 * angular.dot(spin(engine, body))
}
