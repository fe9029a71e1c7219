//! Variable part of a world. A clone is a snapshot; a world given a clone continues bit for bit.

use crate::anchor::Pair;
use crate::bounds::{Fault, MAX_DISTANCE, MAX_SPEED, MAX_SUBSTEPS};
use crate::digest::Digest;
use crate::model::Model;
use palmares_models::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// Upper bound of the number of steps of any world.
const MAX_STEPS: u64 = 1 << 48;

/// The state of a world between two steps.
#[derive(Clone, Serialize, Deserialize)]
pub struct State {
    /// Steps since the beginning.
    pub step: u64,
    /// World pose of the hand's base; identity without a hand.
    pub base: Pose,
    /// Joint coordinates q.
    pub q: Vec<f64>,
    /// Generalized velocity: hand (base linear, base angular, q̇), then each object (linear, angular).
    pub v: Vec<f64>,
    /// Central pose of every object: origin at the centre of mass, object axes.
    pub objects: Vec<Pose>,
    /// Set point of the base servo.
    pub reference: BaseReference,
    /// The motors.
    pub motors: Vec<MotorState>,
    /// Tension of every tendon in the last step.
    pub tension: Vec<f64>,
    /// Force of every row of dry friction in the last step: loss of tension at the guides of each cable, then torque of joints.
    pub friction: Vec<f64>,
    /// The wound length at which each clutch let go, one per tendon with a clutch; None while it is engaged.
    pub locked: Vec<Option<f64>>,
    /// Sleep bookkeeping of every object.
    pub sleep: Vec<Sleep>,
    /// The hand one step earlier.
    pub(crate) earlier: Earlier,
    /// Initial guess for the number of substeps of an undamped hand's next step in flight; 0 if unknown.
    pub(crate) substeps: u32,
    /// Contact memory of the pairs of shapes that have any, ascending by key.
    pub(crate) pairs: Vec<Pair>,
}

/// The moving set point of the base servo.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseReference {
    /// Target pose of the base.
    pub pose: Pose,
    /// m/s
    pub linear: Vec3,
    /// rad/s
    pub angular: Vec3,
}

/// The hand one step earlier.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Earlier {
    /// Whether the motion since was smooth: no contact, no limit acted, and no pose or velocity was set from
    /// outside.
    pub smooth: bool,
    /// Pose and velocity.
    pub motion: HandMotion,
}

/// Pose and velocity of the hand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct HandMotion {
    /// World pose of the base.
    pub base: Pose,
    /// Joint coordinates.
    pub q: Vec<f64>,
    /// The hand's velocities.
    pub v: Vec<f64>,
}

impl HandMotion {
    /// Reads the hand of a state with `n` velocities.
    pub(crate) fn read(&mut self, state: &State, n: usize) {
        self.base = state.base;
        self.q.clear();
        self.q.extend_from_slice(&state.q);
        self.v.clear();
        self.v.extend_from_slice(&state.v[..n]);
    }

    /// Gives the hand of a state this pose and velocity.
    pub(crate) fn write(&self, state: &mut State) {
        state.base = self.base;
        state.q.copy_from_slice(&self.q);
        state.v[..self.v.len()].copy_from_slice(&self.v);
    }
}

/// A motor between two steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotorState {
    /// Commanded σ.
    pub command: f64,
    /// Reached σ.
    pub position: f64,
    /// dσ/dt, 1/s.
    pub velocity: f64,
    /// Part of its largest force that it may use, from 0 to 1.
    pub effort: f64,
}

/// Sleep bookkeeping of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sleep {
    /// Steps for which the object has been slow enough.
    pub still_steps: u32,
    /// Its displacements, linear in m and angular in rad, in the last three thirds of the time of stillness.
    pub moved: [[f64; 6]; 3],
    /// Whether it neither accelerated nor crept in the last of them that has ended.
    pub rests: bool,
    /// Whether it sleeps: it then has no velocity and is not solved.
    pub asleep: bool,
}

impl State {
    /// Everything at rest: the hand as it begins at `base`, the objects at `objects` (object frames).
    pub fn at_rest(model: &Model, base: Pose, objects: &[Pose]) -> Self {
        let hand = model.hand();
        let q = hand.map_or(Vec::new(), |hand| hand.beginning());
        let motors = hand.map_or(Vec::new(), |hand| {
            let at = |motor| {
                let sigma = hand.start.sigma_of(motor);
                MotorState { command: sigma, position: sigma, velocity: 0.0, effort: 1.0 }
            };
            (0..hand.motors.len()).map(at).collect()
        });
        State {
            step: 0,
            base,
            q,
            v: vec![0.0; model.velocity_len()],
            objects: objects
                .iter()
                .zip(model.objects())
                .map(|(pose, object)| {
                    Pose::from_parts(pose.translation + pose.rotation * object.com, pose.rotation)
                })
                .collect(),
            reference: BaseReference { pose: base, linear: Vec3::ZERO, angular: Vec3::ZERO },
            motors,
            tension: hand.map_or(Vec::new(), |hand| vec![0.0; hand.tendons.len()]),
            friction: vec![0.0; model.friction_rows()],
            locked: hand.map_or(Vec::new(), |hand| vec![None; hand.clutches()]),
            sleep: vec![Sleep::default(); model.objects().len()],
            earlier: Earlier::default(),
            substeps: 0,
            pairs: Vec::new(),
        }
    }

    /// The hand of one world together with the objects of another, in a world of `model` that has both: the
    /// hand as in `hand`; objects, their sleep and their contacts as in `objects`, which has no hand.
    pub(crate) fn joined(model: &Model, hand: &State, objects: &State) -> Self {
        let shift = model.hand_colliders() as u32;
        // The hand's shapes come first: within each part the pairs keep their order.
        let own = hand.pairs.iter().filter(|pair| pair.key.1 < shift).cloned();
        let others = objects.pairs.iter().cloned().map(|mut pair| {
            pair.key = (pair.key.0 + shift, pair.key.1 + shift);
            pair
        });
        let mut v = hand.v[..model.hand_dofs()].to_vec();
        v.extend_from_slice(&objects.v);
        State {
            step: 0,
            v,
            objects: objects.objects.clone(),
            sleep: objects.sleep.clone(),
            pairs: own.chain(others).collect(),
            ..hand.clone()
        }
    }

    /// Copies another state into its own memory: a restored world allocates next to nothing.
    pub(crate) fn take_over(&mut self, from: &State) {
        let State {
            step,
            base,
            q,
            v,
            objects,
            reference,
            motors,
            tension,
            friction,
            locked,
            sleep,
            earlier,
            substeps,
            pairs,
        } = from;
        (self.step, self.base, self.reference, self.substeps) = (*step, *base, *reference, *substeps);
        self.q.clone_from(q);
        self.v.clone_from(v);
        self.objects.clone_from(objects);
        self.motors.clone_from(motors);
        self.tension.clone_from(tension);
        self.friction.clone_from(friction);
        self.locked.clone_from(locked);
        self.sleep.clone_from(sleep);
        let (before, motion) = (&mut self.earlier.motion, &earlier.motion);
        (self.earlier.smooth, before.base) = (earlier.smooth, motion.base);
        before.q.clone_from(&motion.q);
        before.v.clone_from(&motion.v);
        self.pairs.clone_from(pairs);
    }

    /// Whether it has the form of a state of this model: lists of the same length, and existing pairs of
    /// shapes.
    pub(crate) fn fits(&self, model: &Model) -> bool {
        let hand = model.hand();
        let joints = hand.map_or(0, |hand| hand.coordinates.len());
        let whole = (joints, model.hand_dofs());
        let before = (self.earlier.motion.q.len(), self.earlier.motion.v.len());
        let objects = model.objects().len();
        let shapes = model.colliders().len() as u32;
        self.step < MAX_STEPS
            && self.substeps <= MAX_SUBSTEPS
            && (self.q.len(), self.v.len()) == (joints, model.velocity_len())
            && (before == whole || (before == (0, 0) && !self.earlier.smooth))
            && (self.objects.len(), self.sleep.len()) == (objects, objects)
            && self.motors.len() == hand.map_or(0, |hand| hand.motors.len())
            && self.tension.len() == hand.map_or(0, |hand| hand.tendons.len())
            && self.friction.len() == model.friction_rows()
            && self.locked.len() == hand.map_or(0, |hand| hand.clutches())
            && self.pairs.iter().all(|pair| pair.key.0 < pair.key.1 && pair.key.1 < shapes)
            && self.pairs.windows(2).all(|two| two[0].key < two[1].key)
    }

    /// Whether every number with which the next step begins is within its bounds: the numbers that
    /// [`State::fault`] checks, and those that contacts, motors, base and the step before have left.
    pub(crate) fn is_bounded(&self) -> bool {
        let near = |x: &f64| x.abs() <= MAX_DISTANCE;
        let is_pose = |pose: &Pose| pose.is_finite() && pose.translation.to_array().iter().all(near);
        let is_motor = |motor: &MotorState| {
            let MotorState { command, position, velocity, effort } = motor;
            [command, position, velocity, effort].into_iter().all(near)
        };
        let BaseReference { pose, linear, angular } = &self.reference;
        self.fault().is_none()
            && self.pairs.iter().all(Pair::is_bounded)
            && is_pose(pose)
            && linear.to_array().iter().chain(&angular.to_array()).all(near)
            && self.motors.iter().all(is_motor)
            && self.locked.iter().flatten().all(near)
            && is_pose(&self.earlier.motion.base)
            && self.earlier.motion.q.iter().chain(&self.earlier.motion.v).all(near)
    }

    /// s since the beginning.
    pub fn time_s(&self, model: &Model) -> f64 {
        self.step as f64 * model.config().step_s
    }

    /// Pose of an object's own frame.
    pub fn object_pose(&self, model: &Model, object: usize) -> Pose {
        let central = self.objects[object];
        let com = model.objects()[object].com;
        Pose::from_parts(central.translation - central.rotation * com, central.rotation)
    }

    /// Linear velocity of the centre of mass and angular velocity of an object.
    pub fn object_velocity(&self, model: &Model, object: usize) -> (Vec3, Vec3) {
        let v = &self.v[model.object_dofs(object)..];
        (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]))
    }

    /// The fault of the state, if any: a number is not finite, or beyond its bound.
    pub fn fault(&self) -> Option<Fault> {
        let within = |x: &f64| x.abs() <= MAX_DISTANCE;
        let slow = self.v.iter().all(|v| v.abs() <= MAX_SPEED);
        let near = |pose: &Pose| pose.translation.to_array().iter().all(within) && pose.rotation.is_finite();
        let tensions = self.tension.iter().chain(&self.friction).all(|f| f.is_finite());
        if slow && tensions && self.q.iter().all(within) && near(&self.base) && self.objects.iter().all(near)
        {
            return None;
        }
        Some(if self.is_finite() { Fault::OutOfBounds } else { Fault::NotFinite })
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.base.is_finite()
            && self.q.iter().chain(&self.v).chain(&self.tension).chain(&self.friction).all(|x| x.is_finite())
            && self.objects.iter().all(|pose| pose.is_finite())
    }

    /// A 64-bit digest of every bit of the state: equal states give equal digests on every machine. The
    /// fields are destructured by name, so that nothing can be forgotten.
    pub fn hash(&self) -> u64 {
        let State {
            step,
            base,
            q,
            v,
            objects,
            reference: BaseReference { pose, linear, angular },
            motors,
            tension,
            friction,
            locked,
            sleep,
            earlier,
            substeps,
            pairs,
        } = self;
        let mut h = Digest::default();
        h.word(*step);
        h.pose(base);
        h.floats(q);
        h.floats(v);
        for pose in objects {
            h.pose(pose);
        }
        h.pose(pose);
        h.vector(*linear);
        h.vector(*angular);
        for MotorState { command, position, velocity, effort } in motors {
            h.floats(&[*command, *position, *velocity]);
            // A motor with all of its force has the same hash as before there was a choice.
            if *effort != 1.0 {
                h.float(*effort);
            }
        }
        h.floats(tension);
        h.floats(friction);
        for locked in locked {
            h.word(u64::from(locked.is_some()));
            h.floats(&[locked.unwrap_or(0.0)]);
        }
        for Sleep { still_steps, moved, rests, asleep } in sleep {
            h.word(u64::from(*still_steps) << 2 | u64::from(*rests) << 1 | u64::from(*asleep));
            h.floats(moved.as_flattened());
        }
        // The earlier step counts only if the motion was smooth.
        let Earlier { smooth, motion: HandMotion { base, q, v } } = earlier;
        h.word(u64::from(*smooth));
        if *smooth {
            h.pose(base);
            h.floats(q);
            h.floats(v);
        }
        h.word(u64::from(*substeps));
        for pair in pairs {
            pair.digest(&mut h);
        }
        h.finish()
    }
}
