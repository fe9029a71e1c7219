//! Actions: the commands of a controller for a tick.

use palmares_models::hand::Hand;
use palmares_models::{Rotation, Vec3};
use palmares_sim::config::BaseConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Targets for one tick. An omitted field keeps its last target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Action {
    /// Target of the hand's base.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<BaseTarget>,
    /// σ of every motor, in the hand's motor order, each in [0, 1].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand: Option<Vec<f64>>,
    /// Part of its largest force that every motor may use, each in [0, 1]; 1 until a run has its first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effort: Option<Vec<f64>>,
}

impl Action {
    /// Checks that the action is valid for this hand.
    pub fn check(&self, hand: &Hand) -> Result<(), ActionError> {
        let finite = |field: &str, values: &[f64]| match values.iter().position(|x| !x.is_finite()) {
            Some(k) => Err(ActionError::NotFinite { field: format!("{field}[{k}]") }),
            None => Ok(()),
        };
        match &self.base {
            Some(BaseTarget::Pose { position, quat_xyzw }) => {
                finite("base.position", position)?;
                finite("base.quat_xyzw", quat_xyzw)?;
                if unit(*quat_xyzw).is_none() {
                    return Err(ActionError::ZeroQuaternion);
                }
            }
            Some(BaseTarget::Twist { linear, angular }) => {
                finite("base.linear", linear)?;
                finite("base.angular", angular)?;
            }
            Some(BaseTarget::Joints { joints }) => finite("base.joints", joints)?,
            None => {}
        }
        for (field, numbers) in [("hand", &self.hand), ("effort", &self.effort)] {
            let Some(numbers) = numbers else { continue };
            finite(field, numbers)?;
            if numbers.len() != hand.motors.len() {
                return Err(ActionError::WrongLength {
                    field,
                    hand: hand.name.clone(),
                    got: numbers.len(),
                    expected: hand.motors.len(),
                });
            }
        }
        Ok(())
    }
}

/// Shorter quaternions are refused: they are rounding, not orientations.
const MIN_QUATERNION_NORM: f64 = 1e-6;

/// The unit quaternion of the direction of finite x, y, z, w; none when it is shorter than 1e-6. One that is unit to
/// rounding is left as it is, so that a unit quaternion's is itself. Neither overflows nor underflows on the way.
pub(crate) fn unit(quat_xyzw: [f64; 4]) -> Option<Rotation> {
    let [x, y, z, w] = quat_xyzw;
    let given = Rotation::from_xyzw(x, y, z, w);
    if (given.length_squared() - 1.0).abs() < 4e-15 {
        return Some(given);
    }
    let largest = quat_xyzw.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if largest == 0.0 {
        return None;
    }
    let [x, y, z, w] = quat_xyzw.map(|x| x / largest);
    let scaled = Rotation::from_xyzw(x, y, z, w);
    // Between 1 and 2 times the largest: what overflows is long enough.
    (largest * scaled.length() >= MIN_QUATERNION_NORM).then(|| scaled.normalize())
}

/// A finite vector of at most that length in the same direction; one that is longer by rounding only is left as it is,
/// so that a clipped one's is itself. Neither overflows nor underflows on the way.
pub(crate) fn clipped(v: Vec3, most: f64) -> Vec3 {
    let largest = v.abs().max_element();
    if largest == 0.0 {
        return v;
    }
    let scaled = v / largest;
    let length = scaled.length();
    if largest * length <= most * (1.0 + 4e-15) { v } else { scaled * (most / length) }
}

/// A pose or velocity of the hand's base in the world frame, or the joints of its arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields)]
pub enum BaseTarget {
    /// Pose target; the servo moves there within its speed and acceleration limits.
    Pose {
        /// m
        position: [f64; 3],
        /// Unit quaternion x, y, z, w; normalised on arrival, a length below 1e-6 is refused.
        quat_xyzw: [f64; 4],
    },
    /// Velocity target.
    Twist {
        /// m/s
        linear: [f64; 3],
        /// rad/s
        angular: [f64; 3],
    },
    /// Target of the arm's joints, where the task has an arm; each moves there as fast as it may.
    Joints {
        /// rad, or m of a joint that slides; in the order of the task's `arm`.
        joints: Vec<f64>,
    },
}

/// Limits to which actions are clipped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActionLimits {
    /// Largest |x|, |y|, |z| of a base position, m.
    pub reach_m: f64,
    /// Largest speed of the base, m/s.
    pub speed: f64,
    /// Largest angular speed of the base, rad/s.
    pub angular_speed: f64,
}

impl ActionLimits {
    /// Half the width of the cube in which the base may be sent about, m.
    pub(crate) const REACH_M: f64 = 2.0;
}

impl Default for ActionLimits {
    fn default() -> Self {
        let base = BaseConfig::default();
        ActionLimits {
            reach_m: Self::REACH_M,
            speed: base.speed_limit,
            angular_speed: base.angular_speed_limit,
        }
    }
}

/// Error of a refused action, which changes nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ActionError {
    /// NaN or infinite number.
    #[error("action.{field} is not a finite number")]
    NotFinite {
        /// Path of the field: `hand[0]`.
        field: String,
    },
    /// Wrong number of motor commands.
    #[error("action.{field} has {got} entries; hand `{hand}` has {expected} motors")]
    WrongLength {
        /// The field: `hand` or `effort`.
        field: &'static str,
        /// Name of the hand.
        hand: String,
        /// Entries in the message.
        got: usize,
        /// Motors of the hand.
        expected: usize,
    },
    /// Joints for a hand that flies freely.
    #[error(
        "action.base.joints: task `{task}` has no arm; base takes position and quat_xyzw, or linear and angular"
    )]
    NoArm {
        /// Name of the task.
        task: String,
    },
    /// Wrong number of joints.
    #[error("action.base.joints has {got} entries; the arm has {expected} joints")]
    WrongJoints {
        /// Entries in the message.
        got: usize,
        /// Joints of the arm.
        expected: usize,
    },
    /// Quaternion without a direction.
    #[error("action.base.quat_xyzw has zero length, or less than 1e-6; a unit quaternion is expected")]
    ZeroQuaternion,
}
