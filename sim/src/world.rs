//! A world: an immutable model, a state, and the scratch memory of a step.

use crate::actuation::{elastic, friction};
use crate::anchor::Pair;
use crate::bounds::Fault;
use crate::command::Command;
use crate::dynamics::jacobian::{add_link_torque, add_point_force};
use crate::dynamics::tree::Kinematics;
use crate::model::{Model, Owner};
use crate::outcome::{ContactForce, PhaseTimer, StepOutcome};
use crate::state::{Sleep, State};
use crate::step::{self, Scratch, SharedScratch, StepForces};
use palmares_models::Vec3;
use std::sync::Arc;

/// A world that can be stepped.
pub struct World {
    model: Arc<Model>,
    pub(crate) state: State,
    pub(crate) scratch: Scratch,
}

impl World {
    /// A world of `model` in `state`.
    pub fn new(model: Arc<Model>, state: State) -> Self {
        World { model, state, scratch: Scratch::default() }
    }

    /// The hand of one world together with the objects of another, in a world of `model` that has both,
    /// including the present force of the base servo.
    pub fn joined(model: Arc<Model>, hand: &World, objects: &World) -> Self {
        let state = State::joined(&model, &hand.state, &objects.state);
        let mut world = World::new(model, state);
        world.scratch.work.forces.base = hand.scratch.work.forces.base;
        world
    }

    /// The model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The present state; clone it for a snapshot.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Restores a snapshot of this world, or another state.
    pub fn restore(&mut self, state: State) {
        self.state = state;
        self.discard_caches();
    }

    /// Discards everything that the last step cached for the next: the state is another.
    pub(crate) fn discard_caches(&mut self) {
        self.scratch.invalidate();
        self.scratch.work.impacts.of_objects.clear();
        self.scratch.work.forces = StepForces::default();
    }

    /// Lets a test or a scene builder set velocities and poses by hand. Contact memory is kept.
    pub fn state_mut(&mut self) -> &mut State {
        self.scratch.invalidate();
        self.state.earlier.smooth = false;
        self.state.substeps = 0;
        self.state.pairs.iter_mut().for_each(Pair::place);
        &mut self.state
    }

    /// Wakes every object, as after a change that sleeping objects do not notice.
    pub fn wake(&mut self) {
        self.state_mut().sleep.fill(Sleep::default());
    }

    /// Advances the world by one step.
    pub fn step(&mut self, command: &Command) -> &StepOutcome {
        self.step_timed(command, &mut ())
    }

    /// Advances the world by one step and notifies `timer` at the end of each phase. A world with a [`Fault`]
    /// does not move.
    pub fn step_timed(&mut self, command: &Command, timer: &mut impl PhaseTimer) -> &StepOutcome {
        step::step(&self.model, &mut self.state, &mut self.scratch, command, timer);
        self.outcome()
    }

    /// Exchanges a part of its scratch memory with the lent one, for the steps until the exchange back. Not
    /// between [`World::prepare`] and the step that it prepares.
    pub fn exchange(&mut self, lent: &mut SharedScratch) {
        self.scratch.exchange(&self.model, lent);
    }

    /// Computes the part of the next step that does not depend on its command: the hand's dynamics and the
    /// search for contacts. The step that follows gives the same bits, sooner. Until then the state's contact
    /// memory is in the middle of a step: take snapshots and hashes before.
    pub fn prepare(&mut self) {
        step::prepare(&self.model, &mut self.state, &mut self.scratch, &mut ());
    }

    /// Applies a force, N, and a torque about its centre of mass, N·m, to an object during the next step, in
    /// world axes. The object wakes. Several add up; a snapshot does not contain them.
    pub fn push_object(&mut self, object: usize, force: Vec3, torque: Vec3) {
        let loads = &mut self.scratch.work.loads;
        loads.resize(self.model.objects().len(), (Vec3::ZERO, Vec3::ZERO));
        let load = &mut loads[object];
        *load = (load.0 + force, load.1 + torque);
        self.state.sleep[object] = Sleep::default();
        self.scratch.prepared = None;
    }

    /// The world's fault, if any: steps do not change the world until it is given another state.
    pub fn fault(&self) -> Option<Fault> {
        self.scratch.work.fault.or_else(|| self.state.fault())
    }

    /// Statistics of the last step.
    pub fn outcome(&self) -> &StepOutcome {
        &self.scratch.work.outcome
    }

    /// Touching contacts of the last step.
    pub fn contact_forces(&self) -> &[ContactForce] {
        &self.scratch.work.forces.contacts
    }

    /// Force and torque of the base servo in the last step, world frame, torque about the base origin.
    pub fn servo_wrench(&self) -> ([f64; 3], [f64; 3]) {
        let [fx, fy, fz, tx, ty, tz] = self.scratch.work.forces.base;
        ([fx, fy, fz], [tx, ty, tz])
    }

    /// Mechanical power of every motor in the last step, W: its load at the end of the step times the speed of its wound length. It is
    /// positive while the motor winds against a tension, and negative while the tendons drive it.
    pub fn motor_power(&self) -> impl Iterator<Item = f64> {
        let motors = self.model.hand().into_iter().flat_map(|hand| {
            hand.motors.iter().enumerate().map(|(k, motor)| (hand.motor_load(k, &self.state.tension), motor))
        });
        motors.zip(&self.state.motors).map(|((load, motor), it)| load * motor.scaling * it.velocity)
    }

    /// Unbalanced torque on every joint coordinate with the forces of the last step at the present
    /// configuration, `Rᵀ f − E (q − q₀) + Jᵀ f_c + limits`, N·m: zero when the hand is at rest.
    pub fn joint_residual(&self) -> Vec<f64> {
        let Some(hand) = self.model.hand() else { return Vec::new() };
        let mut kin = Kinematics::default();
        kin.update(hand, self.state.base, &self.state.q);
        let mut tau = vec![0.0; self.model.hand_dofs()];
        for contact in &self.scratch.work.forces.contacts {
            for (owner, sign) in [(contact.a, -1.0), (contact.b, 1.0)] {
                if let Owner::Link(i) = owner {
                    for (at, force) in contact.parts() {
                        add_point_force(hand, &kin, i, at, force, sign, &mut tau);
                    }
                    add_link_torque(hand, &kin, i, contact.torque, sign, &mut tau);
                }
            }
        }
        for (term, force) in &self.scratch.work.forces.limits {
            tau[term.dof] += force;
        }
        let mut tau = tau.split_off(6);
        for (tendon, f) in hand.tendons.iter().zip(&self.state.tension) {
            tendon.gradient(&self.state.q, |c, r| tau[c] += r * f);
        }
        for (i, c) in hand.coordinates.iter().enumerate() {
            tau[i] -= c.stiffness * (self.state.q[i] - c.rest);
        }
        elastic::subtract_torques(hand, &self.state.q, &mut tau);
        friction::torques(hand, &self.state.q, &self.state.friction, |c, torque| tau[c] += torque);
        tau
    }
}
