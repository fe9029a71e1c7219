//! Wound lengths of drives that no load turns back. They depend on the way: motors stop and clutches let go where the force is the
//! largest.

use super::rest::{Equilibrium, NoPrediction};
use crate::actuation::clutch;
use crate::state::MotorState;
#[cfg(doc)]
use crate::state::State;
use palmares_models::hand::Hand;

/// Largest number of times that a motor stops or a clutch lets go on the way to σ.
const EVENTS: usize = 64;
/// Halvings until the place of an event is known.
const HALVINGS: usize = 50;
/// A force this part below the largest one is the largest one.
const REACHED: f64 = 1e-9;

/// Wound length of every tendon at motor positions σ, if nothing has stopped a motor or let go a clutch.
pub fn wound_lengths(hand: &Hand, sigma: &[f64]) -> Vec<f64> {
    hand.tendons.iter().map(|tendon| tendon.wound(&hand.motors, |motor| sigma[motor])).collect()
}

/// Wound length of every tendon where its motors are, and where its clutch let go: [`State::motors`] and [`State::locked`].
pub fn wound_in(hand: &Hand, motors: &[MotorState], locked: &[Option<f64>]) -> Vec<f64> {
    (0..hand.tendons.len()).map(|k| clutch::wound(hand, k, motors, locked)).collect()
}

/// Wound length of every tendon when all motors have gone together, slowly and without pushes, from the start of a run towards σ.
/// `rest` finds the equilibrium at wound lengths.
///
/// # Errors
/// The lengths of `rest`, or the motors never come to rest.
pub(super) fn wound_slowly(
    hand: &Hand,
    sigma: &[f64],
    mut rest: impl FnMut(&[f64]) -> Result<Equilibrium, NoPrediction>,
) -> Result<Vec<f64>, NoPrediction> {
    if hand.tendons.iter().all(|tendon| tendon.hold_limit.is_none()) {
        return Ok(wound_lengths(hand, sigma));
    }
    let mut way = Way {
        hand,
        sigma: (0..sigma.len()).map(|motor| hand.start.sigma_of(motor)).collect(),
        locked: vec![None; hand.tendons.len()],
    };
    for _ in 0..EVENTS {
        let tension = rest(&way.wound(&way.sigma))?.tension;
        for (locked, (tendon, f)) in way.locked.iter_mut().zip(hand.tendons.iter().zip(&tension)) {
            if tendon.breakaway && locked.is_none() && *f >= tendon.force_limit * (1.0 - REACHED) {
                let at = tendon.wound(&hand.motors, |motor| way.sigma[motor]);
                *locked = Some(at - (f - tendon.force_limit).max(0.0) / tendon.stiffness);
            }
        }
        let change: Vec<f64> = (0..sigma.len()).map(|motor| way.change(motor, sigma, &tension)).collect();
        if change.iter().all(|change| *change == 0.0) {
            break;
        }
        let at = |part: f64| -> Vec<f64> {
            way.sigma.iter().zip(&change).map(|(from, change)| from + part * change).collect()
        };
        // Up to here no force is too large.
        let (mut low, mut high) = (0.0, 1.0);
        if way.exceeds(&change, &rest(&way.wound(&at(1.0)))?.tension) {
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                let too_large = way.exceeds(&change, &rest(&way.wound(&at(middle)))?.tension);
                *(if too_large { &mut high } else { &mut low }) = middle;
            }
        } else {
            low = 1.0;
        }
        let next = if low == 1.0 { sigma.to_vec() } else { at(low) };
        for (motor, from) in way.sigma.iter_mut().enumerate() {
            *from = if change[motor] == 0.0 { *from } else { next[motor] };
        }
    }
    Ok(way.wound(&way.sigma))
}

/// Motors on their way.
struct Way<'a> {
    hand: &'a Hand,
    sigma: Vec<f64>,
    /// By tendon: where its clutch let go.
    locked: Vec<Option<f64>>,
}

impl Way<'_> {
    fn wound(&self, sigma: &[f64]) -> Vec<f64> {
        let free = wound_lengths(self.hand, sigma);
        free.into_iter().zip(&self.locked).map(|(s, at)| at.map_or(s, |at| at.min(s))).collect()
    }

    /// The change of σ that is left for a motor; 0 if one of its drives stops it.
    fn change(&self, motor: usize, sigma: &[f64], tension: &[f64]) -> f64 {
        let change = sigma[motor] - self.sigma[motor];
        let stops = self.hand.tendons.iter().zip(tension).any(|(tendon, f)| {
            let towards = tendon.weight(motor) * self.hand.motors[motor].scaling * change;
            tendon.hold_limit.is_some()
                && !tendon.breakaway
                && towards != 0.0
                && f * towards.signum() >= tendon.force_limit * (1.0 - REACHED)
        });
        if stops { 0.0 } else { change }
    }

    /// Whether a drive pulls more than it can while its motors make this change.
    fn exceeds(&self, change: &[f64], tension: &[f64]) -> bool {
        let each = self.hand.tendons.iter().zip(tension).zip(&self.locked);
        each.into_iter().any(|((tendon, f), locked)| {
            if tendon.hold_limit.is_none() || locked.is_some() {
                return false;
            }
            let towards: f64 = (tendon.motors.iter())
                .map(|&(motor, weight)| weight * self.hand.motors[motor].scaling * change[motor])
                .sum();
            let pull = if tendon.breakaway { *f } else { f * towards.signum() };
            towards != 0.0 && pull > tendon.force_limit
        })
    }
}
