//! The part of a batch's actions that moves the base.

use crate::lookup::one_of;
use palmares_tasks::{BaseTarget, Task};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The first numbers of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Base {
    /// Linear and angular velocity.
    Twist,
    /// Position and quaternion.
    Pose,
    /// So many joints of the arm.
    Joints(usize),
}

impl Base {
    /// Reads the word of Python.
    pub(crate) fn of(word: &str, task: &Task) -> PyResult<Self> {
        match word {
            "twist" => Ok(Base::Twist),
            "pose" => Ok(Base::Pose),
            "joints" => {
                let missing = || {
                    let message =
                        format!("base: task {:?} has no arm; wanted \"twist\" or \"pose\"", task.name);
                    PyValueError::new_err(message)
                };
                let carrier = task.arm.as_ref().ok_or_else(missing)?;
                Ok(Base::Joints(carrier.arm().joints.len()))
            }
            _ => Err(one_of("base", word, "\"twist\", \"pose\" or \"joints\"")),
        }
    }

    /// How many they are.
    pub(crate) fn len(self) -> usize {
        match self {
            Base::Twist => 6,
            Base::Pose => 7,
            Base::Joints(count) => count,
        }
    }

    /// The target in the first numbers of a row.
    pub(crate) fn target(self, row: &[f64]) -> BaseTarget {
        let three = |k: usize| [row[k], row[k + 1], row[k + 2]];
        match self {
            Base::Twist => BaseTarget::Twist { linear: three(0), angular: three(3) },
            Base::Pose => {
                BaseTarget::Pose { position: three(0), quat_xyzw: [row[3], row[4], row[5], row[6]] }
            }
            Base::Joints(count) => BaseTarget::Joints { joints: row[..count].to_vec() },
        }
    }
}
