//! Drives that no load turns back: motors that stop at their largest force, and clutches that let go.

use super::slowed;
use crate::state::{MotorState, State};
use palmares_models::hand::{Hand, Tendon};

/// The tendons of a hand that have a clutch, with their indices.
fn clutches(hand: &Hand) -> impl Iterator<Item = (usize, &Tendon)> {
    hand.tendons.iter().enumerate().filter(|(_, tendon)| tendon.breakaway)
}

/// Lets go the clutches whose tendons have reached their largest force, and engages those to which the motors have come back.
pub(crate) fn advance(hand: &Hand, state: &mut State) {
    for (locked, (k, tendon)) in state.locked.iter_mut().zip(clutches(hand)) {
        let wound = tendon.wound(&hand.motors, |motor| state.motors[motor].position);
        let excess = state.tension[k] - tendon.force_limit;
        *locked = match *locked {
            // Where the force was the largest: the last step has gone beyond.
            None if excess >= 0.0 => Some(wound - excess / tendon.stiffness),
            Some(at) if wound < at => None,
            kept => kept,
        };
    }
}

/// s_ref of a tendon: the length that its motors wind, or the one at which its clutch let go.
pub(crate) fn wound(hand: &Hand, tendon: usize, motors: &[MotorState], locked: &[Option<f64>]) -> f64 {
    let wound = hand.tendons[tendon].wound(&hand.motors, |motor| motors[motor].position);
    if locked.is_empty() || !hand.tendons[tendon].breakaway {
        return wound;
    }
    let slot = clutches(hand).position(|(k, _)| k == tendon);
    slot.and_then(|slot| locked[slot]).map_or(wound, |at| at.min(wound))
}

/// Change of s_ref of a tendon in a step whose motors have moved already.
pub(crate) fn winding(
    hand: &Hand,
    tendon: usize,
    motors: &[MotorState],
    locked: &[Option<f64>],
    step_s: f64,
) -> f64 {
    let before = hand.tendons[tendon]
        .wound(&hand.motors, |motor| motors[motor].position - motors[motor].velocity * step_s);
    let wound = hand.tendons[tendon].wound(&hand.motors, |motor| motors[motor].position);
    // A clutch that has let go moves nothing.
    if self::wound(hand, tendon, motors, locked) < wound { 0.0 } else { wound - before }
}

/// The part of a motor's `change` of σ that its drives allow: one that no load turns back pulls with its largest force at most. The
/// tensions are those of the last step.
pub(crate) fn allowed(hand: &Hand, motor: usize, change: f64, state: &State) -> f64 {
    let mut change = change;
    for (tendon, f) in hand.tendons.iter().zip(&state.tension) {
        let stiffness = tendon.stiffness * tendon.weight(motor) * hand.motors[motor].scaling;
        let effort = slowed::effort(tendon, &state.motors);
        // A motor that may use all of its force opens the clutch before it stops.
        let lets_go = tendon.breakaway && effort == 1.0;
        if tendon.hold_limit.is_none() || lets_go || stiffness * change == 0.0 {
            continue;
        }
        let left = tendon.force_limit * effort - f * (stiffness * change).signum();
        let most = left.max(0.0) / stiffness.abs();
        change = change.clamp(-most, most);
    }
    change
}
