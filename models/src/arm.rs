//! An arm that carries a hand: a chain of joints from its foot to its flange.

use crate::content::ContentHash;
use crate::{Pose, Rotation, Vec3};

/// An arm of ideal drives: its joints are where they are sent, within their limits. It has no mass and touches nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Name of the robot in its file.
    pub name: String,
    /// Pose of its root link in the world.
    pub world_from_root: Pose,
    /// Joints that move, from the foot on.
    pub joints: Vec<ArmJoint>,
    /// Pose of the hand's base in the frame behind the last joint.
    pub last_from_base: Pose,
}

/// A joint of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmJoint {
    /// Name in the file.
    pub name: String,
    /// Whether it turns about its axis; otherwise it slides along it.
    pub turns: bool,
    /// Pose of its frame at 0 in the frame behind the joint before.
    pub before: Pose,
    /// Unit axis in its frame.
    pub axis: Vec3,
    /// Least position, rad or m; −∞ for a joint without end.
    pub lower: f64,
    /// Largest position, rad or m; ∞ for a joint without end.
    pub upper: f64,
    /// Largest speed, rad/s or m/s.
    pub speed: f64,
}

impl ArmJoint {
    /// Pose of the frame behind the joint in the one behind the joint before.
    fn moved(&self, q: f64) -> Pose {
        if !self.turns {
            return self.before * Pose::from_translation(self.axis * q);
        }
        let (sin, cos) = libm::sincos(0.5 * q);
        let axis = self.axis * sin;
        self.before * Pose::from_parts(Vec3::ZERO, Rotation::from_xyzw(axis.x, axis.y, axis.z, cos))
    }

    /// The position in the middle of its range; 0 for a joint without end.
    pub fn middle(&self) -> f64 {
        let middle = 0.5 * (self.lower + self.upper);
        if middle.is_finite() { middle } else { 0.0 }
    }
}

impl Arm {
    /// Pose of the hand's base in the world when the joints are at `q`.
    ///
    /// # Panics
    /// `q` has another length than the joints.
    pub fn base_at(&self, q: &[f64]) -> Pose {
        assert_eq!(q.len(), self.joints.len(), "a position for each joint");
        let behind =
            self.joints.iter().zip(q).fold(self.world_from_root, |at, (joint, q)| at * joint.moved(*q));
        normalized(behind * self.last_from_base)
    }

    /// Linear and angular velocity of the hand's base, world frame, for a unit speed of each joint: the columns of the geometric
    /// Jacobian at the base's origin.
    ///
    /// # Panics
    /// The same as of [`Arm::base_at`].
    pub fn jacobian(&self, q: &[f64]) -> Vec<(Vec3, Vec3)> {
        let tip = self.base_at(q).translation;
        let mut behind = self.world_from_root;
        let column = |(joint, q): (&ArmJoint, &f64)| {
            let frame = behind * joint.before;
            behind *= joint.moved(*q);
            let axis = frame.rotation * joint.axis;
            if joint.turns { (axis.cross(tip - frame.translation), axis) } else { (axis, Vec3::ZERO) }
        };
        self.joints.iter().zip(q).map(column).collect()
    }

    /// `q` within the ranges of the joints.
    pub fn within(&self, q: &[f64]) -> Vec<f64> {
        self.joints.iter().zip(q).map(|(joint, q)| q.clamp(joint.lower, joint.upper)).collect()
    }

    /// Takes in all of it.
    pub fn digest(&self, hash: &mut ContentHash) {
        hash.pose(&self.world_from_root);
        hash.list(&self.joints, |h, joint| {
            h.text(&joint.name);
            h.flag(joint.turns);
            h.pose(&joint.before);
            h.vector(joint.axis);
            h.floats(&[joint.lower, joint.upper, joint.speed]);
        });
        hash.pose(&self.last_from_base);
    }
}

/// Without the rounding of many products.
fn normalized(pose: Pose) -> Pose {
    Pose::from_parts(pose.translation, pose.rotation.normalize())
}
