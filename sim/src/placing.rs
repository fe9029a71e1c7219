//! Poses and velocities that are set from outside, as a learner or a planner does: the hand or an object is somewhere else, and
//! the world goes on from there.
//!
//! Contacts keep their memory, which is a displacement and no place: the forces of the next step are continuous in what is placed,
//! so that differences of steps have a limit. A pair of shapes that no longer touches then loses its memory as always. Every object wakes, because
//! one may have lain on what is gone. Tensions, friction of cables and clutches stay: a step solves them anew from there. Placing
//! something where it is, with the velocity that it has, changes no bit.

use crate::anchor::Pair;
use crate::bounds::{MAX_DISTANCE, MAX_SPEED};
use crate::state::{BaseReference, Sleep};
use crate::world::World;
use palmares_models::{Pose, Vec3};

/// Pose and velocity of the hand.
#[derive(Clone, Debug, PartialEq)]
pub struct HandMotion {
    /// World pose of the base.
    pub base: Pose,
    /// Joint coordinates q, rad or m.
    pub q: Vec<f64>,
    /// Linear velocity of the base's origin, its angular velocity, q̇; m/s, rad/s.
    pub v: Vec<f64>,
}

/// Pose and velocity of an object's centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectMotion {
    /// World pose of the frame at the centre of mass with the object's axes.
    pub central: Pose,
    /// m/s
    pub linear: Vec3,
    /// rad/s
    pub angular: Vec3,
}

/// The reason why something cannot be placed; nothing has changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlacingError {
    /// The world has no hand, or no such object.
    #[error("there is no {0}")]
    Missing(String),
    /// A list has another length.
    #[error("{what}: found {found} numbers; wanted {wanted}")]
    Length {
        /// The list.
        what: &'static str,
        /// Their number.
        found: usize,
        /// The right number.
        wanted: usize,
    },
    /// A quaternion has no direction.
    #[error("quat_xyzw: found {0:?}; wanted a quaternion of length 1")]
    NoDirection([f64; 4]),
    /// The arm cannot bring the base there.
    #[error("base: out of the arm's reach: {0}")]
    OutOfReach(String),
    /// A number is not finite or beyond its bound.
    #[error("{what}: found {found}; wanted a number from -{bound:e} to {bound:e}")]
    OutOfBounds {
        /// The name of the quantity.
        what: &'static str,
        /// The number.
        found: f64,
        /// Its largest amount.
        bound: f64,
    },
}

impl World {
    /// Pose and velocity of the hand; `None` without one.
    pub fn hand_motion(&self) -> Option<HandMotion> {
        self.model().hand()?;
        let (state, dofs) = (self.state(), self.model().hand_dofs());
        Some(HandMotion { base: state.base, q: state.q.clone(), v: state.v[..dofs].to_vec() })
    }

    /// Pose and velocity of an object's centre of mass; `None` if there is no such object.
    pub fn object_motion(&self, object: usize) -> Option<ObjectMotion> {
        let central = *self.state().objects.get(object)?;
        let (linear, angular) = self.state().object_velocity(self.model(), object);
        Some(ObjectMotion { central, linear, angular })
    }

    /// Sets pose and velocity of the hand. The set point of the base servo goes along.
    ///
    /// # Errors
    /// There is no hand, or a list does not fit it, or a number is out of bounds.
    pub fn place_hand(&mut self, to: &HandMotion) -> Result<(), PlacingError> {
        let Some(now) = self.hand_motion() else { return Err(PlacingError::Missing("hand".into())) };
        for (what, found, wanted) in [("q", to.q.len(), now.q.len()), ("v", to.v.len(), now.v.len())] {
            if found != wanted {
                return Err(PlacingError::Length { what, found, wanted });
            }
        }
        bounded("base", &to.base.translation.to_array(), MAX_DISTANCE)?;
        bounded("base", &to.base.rotation.to_array(), MAX_DISTANCE)?;
        bounded("q", &to.q, MAX_DISTANCE)?;
        bounded("v", &to.v, MAX_SPEED)?;
        if *to == now {
            return Ok(());
        }
        let state = &mut self.state;
        state.base = to.base;
        state.q.copy_from_slice(&to.q);
        state.v[..to.v.len()].copy_from_slice(&to.v);
        let three = |k: usize| Vec3::new(to.v[k], to.v[k + 1], to.v[k + 2]);
        state.reference = BaseReference { pose: to.base, linear: three(0), angular: three(3) };
        self.placed();
        Ok(())
    }

    /// Sets σ and dσ/dt, 1/s, of every motor; what is commanded stays.
    ///
    /// # Errors
    /// Another number of motors, or a number that is out of bounds.
    pub fn place_motors(&mut self, to: &[[f64; 2]]) -> Result<(), PlacingError> {
        let wanted = self.state().motors.len();
        if to.len() != wanted {
            return Err(PlacingError::Length { what: "motors", found: to.len(), wanted });
        }
        bounded("motors", to.as_flattened(), MAX_SPEED)?;
        let there = self.state().motors.iter().map(|motor| [motor.position, motor.velocity]);
        if there.eq(to.iter().copied()) {
            return Ok(());
        }
        for (motor, [position, velocity]) in self.state.motors.iter_mut().zip(to) {
            (motor.position, motor.velocity) = (*position, *velocity);
        }
        self.placed();
        Ok(())
    }

    /// Sets pose and velocity of an object.
    ///
    /// # Errors
    /// There is no such object, or a number is out of bounds.
    pub fn place_object(&mut self, object: usize, to: &ObjectMotion) -> Result<(), PlacingError> {
        let Some(now) = self.object_motion(object) else {
            return Err(PlacingError::Missing(format!("object {object}")));
        };
        bounded("position", &to.central.translation.to_array(), MAX_DISTANCE)?;
        bounded("quat_xyzw", &to.central.rotation.to_array(), MAX_DISTANCE)?;
        bounded("linear", &to.linear.to_array(), MAX_SPEED)?;
        bounded("angular", &to.angular.to_array(), MAX_SPEED)?;
        if *to == now {
            return Ok(());
        }
        let first = self.model().object_dofs(object);
        self.state.objects[object] = to.central;
        self.state.v[first..first + 3].copy_from_slice(&to.linear.to_array());
        self.state.v[first + 3..first + 6].copy_from_slice(&to.angular.to_array());
        self.placed();
        Ok(())
    }

    /// Forgets what the last step has left for the next beside the memory of contacts; wakes every object.
    fn placed(&mut self) {
        let state = &mut self.state;
        state.sleep.fill(Sleep::default());
        state.earlier.smooth = false;
        state.substeps = 0;
        state.pairs.iter_mut().for_each(Pair::place);
        self.discard_caches();
    }
}

fn bounded(what: &'static str, numbers: &[f64], bound: f64) -> Result<(), PlacingError> {
    match numbers.iter().find(|x| x.is_nan() || x.abs() > bound) {
        Some(found) => Err(PlacingError::OutOfBounds { what, found: *found, bound }),
        None => Ok(()),
    }
}
