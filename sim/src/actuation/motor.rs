//! Motors: the position σ follows its command at a bounded speed.

use crate::state::MotorState;
use palmares_models::hand::Motor;

/// Advances a motor by one step of length h towards σ = `command`, which is clamped to [0, 1]. `allowed` maps the change of σ to the
/// part of it that its drives allow.
pub fn advance(
    motor: &Motor,
    state: &mut MotorState,
    command: f64,
    h: f64,
    allowed: impl FnOnce(f64) -> f64,
) {
    state.command = command.clamp(0.0, 1.0);
    let reach = motor.speed_limit * h;
    let change = allowed((state.command - state.position).clamp(-reach, reach));
    state.position += change;
    state.velocity = change / h;
}
