//! rapier: the same scene in an independent engine.
//!
//! The hand is one reduced-coordinate multibody. A rolling joint needs a massless coupler and a coupling of two
//! coordinates, because a joint of rapier has its own coordinate; the tendon is an implicit cable that enters
//! through the springs of the joints, which is the only implicit generalized force that the public interface has.

mod hand;
mod joints;
mod scene;
mod settings;
mod tendon;

use super::adapter::Adapter;
use anyhow::Result;
use cpu_time::ThreadTime;
use hand::HandBody;
use palmares_bench::engine::clock;
use palmares_bench::engine::{Cost, Engine};
use palmares_sim::StepOutcome;
use palmares_sim::{Command, Model, State};
use rapier3d_f64::dynamics::RigidBodyHandle;
use rapier3d_f64::pipeline::PhysicsWorld;
use scene::Surfaces;
pub use settings::{FOUND, SETTINGS, SPACE, STIFF120, Settings};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// Time to read the clock.
static OVERHEAD: OnceLock<Duration> = OnceLock::new();

/// Its version.
pub const VERSION: &str = "0.36.1";

/// Notes on all settings, for the report.
pub fn notes() -> Vec<String> {
    [
        "rapier3d-f64 0.36.1, enhanced-determinism, one thread",
        "contact recycling and clustering off, no limit of speed",
        "hand: one multibody on a floating root; the base servo is spring and damper of the root, same gains, and none of both \
         where it is switched off; a bolted base is a fixed root",
        "rolling joints: two hinges, a coupler of 0.1 g, MultibodyDofCoupling",
        "tendon: implicit cable by the reduced inertia (couplings and last contact impulses included), applied \
         through set_spring",
        "restitution of a pair: the larger one, as ours",
        "not passed on, so that scenes with it are not played: rolling resistance, friction against spin, dry friction of joints",
        "a hand with gravity compensation weighs nothing",
    ]
    .map(String::from)
    .to_vec()
}

/// A scene in rapier.
pub(super) struct Rapier {
    model: Arc<Model>,
    state: State,
    world: PhysicsWorld,
    surfaces: Surfaces,
    hand: Option<HandBody>,
    objects: Vec<RigidBodyHandle>,
    /// The state was changed by hand since the last step.
    touched: bool,
    outcome: StepOutcome,
    overhead: Duration,
}

impl Rapier {
    pub(super) fn new(model: Arc<Model>, state: State, settings: &Settings) -> Result<Self> {
        let mut world = PhysicsWorld::new();
        world.gravity = model.config().gravity;
        settings.apply(&mut world.integration_parameters, &model);
        let hand = match model.hand() {
            Some(hand) => Some(HandBody::build(&mut world, hand, &state, model.config().base.bolted)?),
            None => None,
        };
        let objects = scene::add_objects(&mut world, &model);
        scene::add_colliders(&mut world, &model, hand.as_ref(), &objects);
        let surfaces = Surfaces::new(Arc::clone(&model));
        let mut rapier = Rapier {
            model,
            state,
            world,
            surfaces,
            hand,
            objects,
            touched: true,
            outcome: StepOutcome { converged: true, ..StepOutcome::default() },
            overhead: clock::overhead(&OVERHEAD, || ThreadTime::now().elapsed()),
        };
        // A moment to find mass matrix and Jacobians, which the tendon of the first step needs.
        rapier.push_state();
        rapier.world.integration_parameters.dt = 1e-9;
        rapier.world.step_with_events(&rapier.surfaces, &());
        rapier.world.integration_parameters.dt = rapier.model.config().step_s;
        Ok(rapier)
    }

    /// Poses and velocities from the state into rapier.
    fn push_state(&mut self) {
        if let Some(hand) = &self.hand {
            hand.push(&mut self.world, &self.state);
        }
        for (k, handle) in self.objects.iter().enumerate() {
            let (linear, angular) = self.state.object_velocity(&self.model, k);
            if let Some(body) = self.world.bodies.get_mut(*handle) {
                body.set_position(self.state.objects[k], true);
                body.set_linvel(linear, true);
                body.set_angvel(angular, true);
            }
        }
        self.touched = false;
    }

    /// Poses and velocities from rapier into the state.
    fn pull_state(&mut self) {
        if let Some(hand) = &self.hand {
            hand.pull(&self.world, &mut self.state);
        }
        for (k, handle) in self.objects.iter().enumerate() {
            let body = &self.world.bodies[*handle];
            self.state.objects[k] = *body.position();
            let v = &mut self.state.v[self.model.object_dofs(k)..];
            v[..3].copy_from_slice(&body.linvel().to_array());
            v[3..6].copy_from_slice(&body.angvel().to_array());
        }
        self.state.step += 1;
        self.outcome.penetration_m = scene::penetration(&self.world);
        self.outcome.converged = self.state.is_finite();
    }
}

impl Engine for Rapier {
    fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn step(&mut self, command: &Command) -> Result<Cost> {
        Adapter::RAPIER.obeys(&self.model, command)?;
        if self.touched {
            self.push_state();
        }
        // The adapter finds the tendons' pulls: rapier has none, and its time has none.
        if let Some(hand) = &self.hand {
            hand.actuate(&mut self.world, &self.model, &mut self.state, command);
        }
        let start = ThreadTime::now();
        self.world.step_with_events(&self.surfaces, &());
        let total_s = clock::spent_s(start, self.overhead);
        self.pull_state();
        Ok(Cost { total_s, ..Cost::default() })
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
}
