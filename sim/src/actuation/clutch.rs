//! Drives that no load turns back: motors that stop at their largest force, and clutches that let go.

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
        *locked = match *locked {
            None if state.tension[k] >= tendon.force_limit => Some(wound),
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

/// Whether a motor cannot go on in the direction of `change`: a tendon that no load turns back pulls with its largest force.
pub(crate) fn stalls(hand: &Hand, motor: usize, change: f64, tension: &[f64]) -> bool {
    let scaling = hand.motors[motor].scaling;
    hand.tendons.iter().zip(tension).any(|(tendon, f)| {
        let holds = tendon.hold_limit.is_some() && !tendon.breakaway;
        holds && f * (tendon.weight(motor) * scaling * change).signum() >= tendon.force_limit
    })
}
