//! What drives the hand in a step, beside its motors.

use crate::command::Push;

/// Forces from outside, and the base's servo.
#[derive(Default)]
pub(crate) struct Drive {
    /// Forces from outside.
    pub pushes: Vec<Push>,
    /// Whether the base servo acts.
    pub servo_on: bool,
    /// Whether the base is bolted to its set point.
    pub bolted: bool,
}
