//! A run whose hand, motors or objects are put elsewhere, for learners and planners in the same process. No server does it, and
//! a run that it was done to has no replay.

use super::Run;
use super::cameras::ImageCache;
use super::placement::Placement;
use super::targets::BaseMotion;
use crate::action::{BaseTarget, unit};
use crate::observation::BodyState;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::placing::{HandMotion, ObjectMotion, PlacingError};

impl Run {
    /// Whether something was put elsewhere or an object pushed since tick 0: the actions alone do not play the run again.
    pub fn is_altered(&self) -> bool {
        self.altered
    }

    /// σ and dσ/dt, 1/s, of every motor.
    pub fn motor_motion(&self) -> Vec<[f64; 2]> {
        self.world.state().motors.iter().map(|motor| [motor.position, motor.velocity]).collect()
    }

    /// Pose and velocity of the base.
    pub fn base_state(&self) -> BodyState {
        let state = self.world.state();
        let three = |k: usize| [state.v[k], state.v[k + 1], state.v[k + 2]];
        BodyState {
            position: state.base.translation.to_array(),
            quat_xyzw: state.base.rotation.to_array(),
            linear: three(0),
            angular: three(3),
        }
    }

    /// Puts the hand, its motors or the objects elsewhere. The target of the base goes along. Putting a thing where it is, bit for bit,
    /// changes nothing.
    ///
    /// # Errors
    /// A list has the wrong length, a quaternion no direction, or a number is out of bounds; nothing has changed.
    pub fn place(&mut self, to: &Placement) -> Result<(), PlacingError> {
        let (before, carrying) = (self.world.snapshot(), self.carrying.clone());
        let placed = self.place_all(to);
        if placed.is_err() {
            self.world.resume(&before);
            self.carrying = carrying;
        }
        placed
    }

    fn place_all(&mut self, to: &Placement) -> Result<(), PlacingError> {
        let (hash, carrying) = (self.world.state().hash(), self.carrying.clone());
        self.prepared = None;
        if let Some(wanted) = &to.motors {
            self.world.place_motors(wanted)?;
        }
        let mut hand = self.world.hand_motion().ok_or_else(|| PlacingError::Missing("hand".into()))?;
        if let Some(base) = &to.base {
            let now = self.base_state();
            hand.base = pose(base, &now)?;
            hand.v[..3].copy_from_slice(&base.linear);
            hand.v[3..6].copy_from_slice(&base.angular);
        }
        for (what, wanted, own) in
            [("q", &to.q, &mut hand.q[..]), ("joint_velocity", &to.joint_velocity, &mut hand.v[6..])]
        {
            let Some(wanted) = wanted else { continue };
            if wanted.len() != own.len() {
                return Err(PlacingError::Length { what, found: wanted.len(), wanted: own.len() });
            }
            own.copy_from_slice(wanted);
        }
        if let (Some(carrying), true) = (&mut self.carrying, to.base.is_some()) {
            carrying.put(hand.base).map_err(PlacingError::OutOfReach)?;
        }
        self.world.place_hand(&hand)?;
        if let Some(wanted) = &to.objects {
            let now: Vec<BodyState> = self.object_states().collect();
            if wanted.len() != now.len() {
                return Err(PlacingError::Length { what: "objects", found: wanted.len(), wanted: now.len() });
            }
            for (object, (wanted, now)) in wanted.iter().zip(&now).enumerate().filter(|(_, (a, b))| a != b) {
                let frame = pose(wanted, now)?;
                let from_com = frame.rotation * self.world.model().objects()[object].com;
                let angular = Vec3::from_array(wanted.angular);
                let motion = ObjectMotion {
                    central: Pose::from_parts(frame.translation + from_com, frame.rotation),
                    linear: Vec3::from_array(wanted.linear) + angular.cross(from_com),
                    angular,
                };
                self.world.place_object(object, &motion)?;
            }
        }
        if self.world.state().hash() == hash {
            self.carrying = carrying;
            return Ok(());
        }
        self.altered = true;
        self.image_cache = ImageCache::default();
        if to.base.is_some() {
            let HandMotion { base, .. } = hand;
            let (position, quat_xyzw) = (base.translation.to_array(), base.rotation.to_array());
            self.target = BaseMotion::Pose { from: base, to: base };
            self.applied.base = Some(BaseTarget::Pose { position, quat_xyzw });
            if let Some(carrying) = &self.carrying {
                (self.target, self.applied.base) = (BaseMotion::Joints, Some(carrying.target()));
            }
        }
        Ok(())
    }
}

/// The pose of a body; a quaternion that is the present one keeps its bits.
fn pose(wanted: &BodyState, now: &BodyState) -> Result<Pose, PlacingError> {
    let given = wanted.quat_xyzw;
    let rotation = match given == now.quat_xyzw {
        true => Some(Rotation::from_array(given)),
        false => Some(given).filter(|given| given.iter().all(|x| x.is_finite())).and_then(unit),
    };
    let rotation = rotation.ok_or(PlacingError::NoDirection(given))?;
    Ok(Pose::from_parts(Vec3::from_array(wanted.position), rotation))
}
