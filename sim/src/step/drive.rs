//! Inputs that drive the hand in a step, besides its motors.

use crate::command::Push;

/// External forces, and the base's servo.
#[derive(Default)]
pub(crate) struct Drive {
    /// External forces.
    pub pushes: Vec<Push>,
    /// Whether the base servo acts.
    pub servo_on: bool,
    /// Whether the base is bolted to its set point.
    pub bolted: bool,
}
