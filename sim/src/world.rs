//! A world: an immutable model, a state, and the scratch memory of a step.

use crate::actuation::base::BaseCommand;
use crate::bounds::Fault;
use crate::contact::broad::BroadPhase;
use crate::contact::cascade::Cascade;
use crate::contact::narrow::Contacts;
use crate::contact::near::Near;
use crate::dynamics::crba::Inertias;
use crate::dynamics::jacobian::add_point_force;
use crate::dynamics::rnea::Recursion;
use crate::dynamics::tree::Kinematics;
use crate::model::{Model, Owner};
use crate::solver::island::Islands;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::solver::terms::AxisTerm;
use crate::state::{Earlier, State};
use crate::step::{Met, Stages};
use palmares_models::{Pose, Vec3};
use parry3d_f64::bounding_volume::Aabb;
use std::sync::Arc;

/// What the world is told for one step.
#[derive(Clone, Debug)]
pub struct Command {
    /// The base.
    pub base: BaseCommand,
    /// σ of every motor, clamped to [0, 1].
    pub sigma: Vec<f64>,
    /// Forces from outside: the paper's virtual contacts.
    pub pushes: Vec<Push>,
}

impl Command {
    /// Stay at a pose with the motors at rest.
    pub fn stay(model: &Model, pose: Pose) -> Self {
        Command {
            base: BaseCommand::stay(pose),
            sigma: vec![0.0; model.hand().map_or(0, |hand| hand.motors.len())],
            pushes: Vec::new(),
        }
    }
}

/// A force on a link of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Which link.
    pub link: usize,
    /// Where, in the link frame, m.
    pub point: Vec3,
    /// Force in the world frame, N.
    pub force: Vec3,
}

/// How a step went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Newton iterations of the island that needed most.
    pub iterations: usize,
    /// Line search evaluations over all islands.
    pub evaluations: usize,
    /// Whether every island reached the tolerance.
    pub converged: bool,
    /// Contact points given to the solver.
    pub points: usize,
    /// Deepest overlap of shapes at the start of the step, m.
    pub penetration_m: f64,
    /// Islands solved.
    pub islands: usize,
    /// Bodies asleep at the end of the step.
    pub asleep: usize,
    /// What the step computed, in the unit of [`crate::bounds`].
    pub work: u64,
}

/// A touching contact as the last step solved it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// First body.
    pub a: Owner,
    /// Second body.
    pub b: Owner,
    /// Their shapes, as places in the model's list of colliders.
    pub colliders: (u32, u32),
    /// Place in the world, m.
    pub position: Vec3,
    /// Unit normal from A to B.
    pub normal: Vec3,
    /// Force on B, N.
    pub force: Vec3,
    /// Gap at the start of the step, m.
    pub distance: f64,
}

/// Parts of a step, for those who measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Kinematics, mass matrix, bias.
    Dynamics,
    /// Broad and narrow phase.
    Collision,
    /// Islands, Newton, integration.
    Solver,
}

/// Told when a phase of a step has ended; this crate knows no clock.
pub trait Probe {
    /// `phase` is over.
    fn ended(&mut self, phase: Phase);
}

impl Probe for () {
    fn ended(&mut self, _: Phase) {}
}

/// A world that can be stepped.
pub struct World {
    pub(crate) model: Arc<Model>,
    pub(crate) state: State,
    pub(crate) outcome: Outcome,
    pub(crate) fault: Option<Fault>,
    pub(crate) work: Workspace,
}

/// Memory that carries nothing from step to step, except capacity and orderings.
#[derive(Default)]
pub(crate) struct Workspace {
    pub kin: Kinematics,
    pub inertias: Inertias,
    pub recursion: Recursion,
    pub bias: Vec<f64>,
    pub mass: Vec<f64>,
    pub broad: BroadPhase,
    pub near: Near,
    pub contacts: Contacts,
    pub poses: Vec<Pose>,
    pub bounds: Vec<Aabb>,
    pub speeds: Vec<f64>,
    /// The same one step earlier; empty when the state was changed from outside.
    pub speeds_before: Vec<f64>,
    /// Largest way that any point of each shape can have made in the last step, m.
    pub paths: Vec<f64>,
    pub islands: Islands,
    pub solvers: Vec<(Problem, Newton)>,
    pub velocity: Vec<f64>,
    pub forces: Vec<ContactForce>,
    pub limits: Vec<(AxisTerm, f64)>,
    pub servo_force: [f64; 6],
    /// Whether the next step's dynamics and contacts are known already, ...
    pub begun: bool,
    /// ... and what they took to compute.
    pub spent: u64,
    /// Forces from outside in this step.
    pub pushes: Vec<Push>,
    /// Whether the base servo acts in this step.
    pub servo_on: bool,
    /// Whether it is bolted to its set point.
    pub held: bool,
    /// What the explicit method keeps of a step.
    pub stages: Option<Box<Stages>>,
    /// Of every object: when in this step it rebounds, if it does.
    pub met: Vec<Option<Met>>,
    /// Impacts of several bodies in this step.
    pub cascade: Cascade,
    /// The hand at the start of a step.
    pub now: Earlier,
    /// By how much the hand's velocities change more than in the step before.
    pub change: Vec<f64>,
    /// Of every object: force and torque about its centre of mass from outside during the next step; empty for none.
    pub loads: Vec<(Vec3, Vec3)>,
}

impl World {
    /// A world of `model` in `state`.
    pub fn new(model: Arc<Model>, state: State) -> Self {
        World { model, state, outcome: Outcome::default(), fault: None, work: Workspace::default() }
    }

    /// The hand of one world beside the objects of another, in a world of `model` that has both; with the force
    /// that the base servo acts with.
    pub fn joined(model: Arc<Model>, hand: &World, objects: &World) -> Self {
        let state = State::joined(&model, &hand.state, &objects.state);
        let mut world = World::new(model, state);
        world.work.servo_force = hand.work.servo_force;
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

    /// Goes back (or elsewhere) to a snapshot.
    pub fn restore(&mut self, state: State) {
        self.state = state;
        self.fault = None;
        self.work.begun = false;
        self.work.met.clear();
        self.work.broad.invalidate();
        self.work.bounds.clear();
        self.work.speeds.clear();
        self.work.forces.clear();
        self.work.limits.clear();
    }

    /// Lets a test or a scene builder set velocities and poses by hand. Contact memory is kept.
    pub fn state_mut(&mut self) -> &mut State {
        self.fault = None;
        self.work.begun = false;
        self.work.broad.invalidate();
        self.work.bounds.clear();
        self.work.speeds.clear();
        self.state.earlier.smooth = false;
        self.state.substeps = 0;
        &mut self.state
    }

    /// Lets a force and a torque about its centre of mass act on an object during the next step, in the world's axes.
    /// It wakes. Several add up; a snapshot does not remember them.
    pub fn push_object(&mut self, object: usize, force: Vec3, torque: Vec3) {
        self.work.loads.resize(self.model.objects().len(), (Vec3::ZERO, Vec3::ZERO));
        let load = &mut self.work.loads[object];
        *load = (load.0 + force, load.1 + torque);
        self.state.sleep[object] = crate::state::Sleep::default();
        self.work.begun = false;
    }

    /// Why the world stands still, if it does: steps no longer change it until it is given another state.
    pub fn fault(&self) -> Option<Fault> {
        self.fault.or_else(|| self.state.fault())
    }

    /// How the last step went.
    pub fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// Touching contacts of the last step.
    pub fn contact_forces(&self) -> &[ContactForce] {
        &self.work.forces
    }

    /// Force and torque of the base servo in the last step, world frame, torque about the base origin.
    pub fn servo_wrench(&self) -> ([f64; 3], [f64; 3]) {
        let [fx, fy, fz, tx, ty, tz] = self.work.servo_force;
        ([fx, fy, fz], [tx, ty, tz])
    }

    /// Unbalanced torque on every joint coordinate with the forces of the last step at the present
    /// configuration, `Rᵀ f − E (q − q₀) + Jᵀ f_c + limits`, N·m: zero when the hand is at rest.
    pub fn joint_residual(&self) -> Vec<f64> {
        let Some(hand) = self.model.hand() else { return Vec::new() };
        let mut kin = Kinematics::default();
        kin.update(hand, self.state.base, &self.state.q);
        let mut tau = vec![0.0; self.model.hand_dofs()];
        for contact in &self.work.forces {
            for (owner, sign) in [(contact.a, -1.0), (contact.b, 1.0)] {
                if let Owner::Link(i) = owner {
                    add_point_force(hand, &kin, i, contact.position, contact.force, sign, &mut tau);
                }
            }
        }
        for (term, force) in &self.work.limits {
            tau[term.dof] += force;
        }
        let mut tau = tau.split_off(6);
        for (tendon, f) in hand.tendons.iter().zip(&self.state.tension) {
            tendon.gradient(&self.state.q, |c, r| tau[c] += r * f);
        }
        for (i, c) in hand.coordinates.iter().enumerate() {
            tau[i] -= c.stiffness * (self.state.q[i] - c.rest);
        }
        tau
    }
}
