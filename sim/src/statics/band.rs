//! Equilibria of a hand whose cables and joints rub: it can rest anywhere between two limits.
//!
//! In the closing limit every cable is about to slide towards its motor and every joint about to close; in the opening limit cables are
//! about to be pulled out. The torques of friction have no energy, because each joint feels another tension of the same cable: Newton's
//! method finds the balance of torques itself.

use crate::actuation::friction;
use crate::command::Push;
use crate::config::Config;
use crate::statics::drives::wound_slowly;
use crate::statics::energy::StaticsProblem;
use crate::statics::equilibrium::NoEquilibrium;
use crate::statics::loads::torque_work;
use crate::statics::prediction::solve_wound;
use crate::statics::rest::{Equilibrium, NoPrediction, spend};
use nalgebra::{DMatrix, DVector};
use palmares_models::Pose;
use palmares_models::hand::Hand;

/// Newton's method ends when the torques balance to this part of their magnitudes.
const BALANCE: f64 = 1e-12;
/// Largest accepted unbalanced part of them.
const BALANCED: f64 = 1e-9;
/// Half the difference of two evaluations for a derivative, rad or m.
const DIFFERENCE: f64 = 1e-8;
/// Largest number of Newton steps for one amount of friction.
const STEPS: usize = 60;
/// Largest number of steps of a search that do not bring the torques nearer to balance.
const LEAPS: usize = 4;
/// Parts of the friction by which it grows where its whole is too much at once.
const PARTS: [f64; 8] = [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0];
/// Largest computing of a search, in the unit of [`crate::bounds`]: a second or two.
const MAX_WORK: u64 = 2_000_000_000;

/// The limits between which a hand rests.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Where it comes to rest while it closes.
    pub closing: Equilibrium,
    /// Where it comes to rest while it opens.
    pub opening: Equilibrium,
}

/// The effect of friction at an equilibrium.
#[derive(Clone, Copy, Debug)]
enum Friction<'a> {
    /// It resists this direction with all it has: 1 for closing, −1 for opening.
    Against(f64),
    /// It has these forces, one per row of friction.
    Held(&'a [f64]),
}

/// The limits at motor positions σ under pushes and, if the hand does not cancel it, its own weight. Motors that no load turns back have
/// gone to σ slowly. A hand without friction has one equilibrium: both limits.
///
/// # Errors
/// No balance was reached, or a joint is unconstrained.
pub fn band(
    config: &Config,
    hand: &Hand,
    base: Pose,
    sigma: &[f64],
    pushes: &[Push],
) -> Result<Band, NoPrediction> {
    let closing =
        |s_ref: &[f64], pushes: &[Push]| limit(config, hand, base, s_ref, pushes, Friction::Against(1.0));
    let s_ref = wound_slowly(hand, sigma, |s_ref| closing(s_ref, &[]))?;
    band_wound(config, hand, base, &s_ref, pushes)
}

/// The same at wound lengths, one per tendon.
///
/// # Errors
/// As [`band`].
pub fn band_wound(
    config: &Config,
    hand: &Hand,
    base: Pose,
    s_ref: &[f64],
    pushes: &[Push],
) -> Result<Band, NoPrediction> {
    let closing = limit(config, hand, base, s_ref, pushes, Friction::Against(1.0))?;
    if hand.friction_places() == 0 {
        return Ok(Band { opening: closing.clone(), closing });
    }
    let opening = limit(config, hand, base, s_ref, pushes, Friction::Against(-1.0))?;
    Ok(Band { closing, opening })
}

/// The equilibrium at wound lengths with these forces of friction, such as those of a state at rest.
///
/// # Errors
/// As [`band`].
pub fn solve_held(
    config: &Config,
    hand: &Hand,
    base: Pose,
    s_ref: &[f64],
    pushes: &[Push],
    friction: &[f64],
) -> Result<Equilibrium, NoPrediction> {
    limit(config, hand, base, s_ref, pushes, Friction::Held(friction))
}

fn limit(
    config: &Config,
    hand: &Hand,
    base: Pose,
    s_ref: &[f64],
    pushes: &[Push],
    rubs: Friction<'_>,
) -> Result<Equilibrium, NoPrediction> {
    let without = solve_wound(config, hand, base, s_ref, pushes)?;
    if hand.friction_places() == 0 {
        return Ok(without);
    }
    let problem = StaticsProblem { config, hand, base, s_ref, pushes, holds: &[] };
    let search = Search { problem: &problem, closing: closing_signs(hand, &without.q), rubs };
    let mut left = MAX_WORK;
    let mut q = without.q.clone();
    if search.balance(&mut q, 1.0, &mut left).is_err() {
        q = without.q;
        for part in PARTS {
            search.balance(&mut q, part, &mut left)?;
        }
    }
    let mut found = problem.equilibrium(q);
    found.beyond_closed_form.push("cables or joints rub".to_owned());
    Ok(found)
}

/// Direction in which each joint closes: in which its tendons pull it.
fn closing_signs(hand: &Hand, q: &[f64]) -> Vec<f64> {
    let mut arms = vec![0.0; q.len()];
    for tendon in &hand.tendons {
        tendon.gradient(q, |c, r| arms[c] += r);
    }
    arms.iter().map(|arm| if *arm < 0.0 { -1.0 } else { 1.0 }).collect()
}

struct Search<'a> {
    problem: &'a StaticsProblem<'a>,
    /// By joint: 1 or −1.
    closing: Vec<f64>,
    rubs: Friction<'a>,
}

impl Search<'_> {
    /// Unbalanced torque on each coordinate with a part of the friction, and the largest torque in it.
    fn unbalanced(&self, q: &[f64], part: f64) -> (DVector<f64>, f64) {
        let hand = self.problem.hand;
        let (gradient, size) = self.problem.gradient(q);
        let mut torque = -gradient;
        match self.rubs {
            Friction::Held(forces) => friction::torques(hand, q, forces, |c, x| torque[c] += part * x),
            Friction::Against(direction) => {
                friction::sliding(hand, q, &self.problem.tension(q), direction, part, &mut |c, x| {
                    torque[c] += x
                });
                for (c, joint) in hand.coordinates.iter().enumerate() {
                    torque[c] -= part * direction * self.closing[c] * joint.friction;
                }
            }
        }
        (torque, size)
    }

    /// Newton's method with halved steps from q on.
    fn balance(&self, q: &mut Vec<f64>, part: f64, left: &mut u64) -> Result<(), NoPrediction> {
        let n = q.len();
        let evaluation = torque_work(self.problem.hand, self.problem.pushes.len())
            + (n * (1 + self.problem.hand.tendons.len())) as u64;
        let (mut torque, mut size) = self.unbalanced(q, part);
        let mut leaps = 0;
        for _ in 0..STEPS {
            if torque.amax() <= BALANCE * size {
                break;
            }
            spend(left, (2 * n as u64 + 1) * evaluation + (n * n * n) as u64)?;
            let mut slope = DMatrix::zeros(n, n);
            let mut moved = q.clone();
            for k in 0..n {
                let mut at = |x: f64| {
                    moved[k] = x;
                    self.unbalanced(&moved, part).0
                };
                let column = (at(q[k] + DIFFERENCE) - at(q[k] - DIFFERENCE)) / (2.0 * DIFFERENCE);
                moved[k] = q[k];
                slope.set_column(k, &column);
            }
            let Some(step) = slope.lu().solve(&torque) else { break };
            let mut length = 1.0;
            let to = |length: f64| -> Vec<f64> {
                q.iter().zip(step.iter()).map(|(q, d)| q - length * d).collect()
            };
            let (there, next) = loop {
                spend(left, evaluation)?;
                let there = to(length);
                let next = self.unbalanced(&there, part);
                if next.0.norm() < (1.0 - 1e-4 * length) * torque.norm() {
                    break (there, next);
                }
                length *= 0.5;
                if length < 1e-9 {
                    // At a corner, where a cable tightens, the slope is that of neither side: the whole step leaves it.
                    leaps += 1;
                    let there = to(1.0);
                    let next = self.unbalanced(&there, part);
                    break (there, next);
                }
            };
            if leaps > LEAPS {
                break;
            }
            *q = there;
            (torque, size) = next;
        }
        let residual = torque.amax();
        if residual <= BALANCED * size { Ok(()) } else { Err(NoEquilibrium { residual }.into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::hand::Guide;

    /// The SoftHand with one cable through all its joints.
    fn softhand(exponent: f64) -> Hand {
        let mut hand = Hand::clone(&Hand::builtin("softhand").expect("it is built in"));
        let order = hand.tendons[0].coordinates();
        let guide = |coordinate| Guide::new(coordinate, exponent, 1.0);
        hand.tendons[0].guides = order.into_iter().map(guide).collect();
        hand
    }

    /// q₀ + E⁻¹ a T with `T (1/K + r E⁻¹ a) = s − r q₀` and `a_j = r_j e^{∓Σμφ}`.
    #[test]
    fn with_constant_arms_the_limits_are_a_closed_form() {
        let exponent = 0.05;
        let hand = softhand(exponent);
        let s = 2.0;
        let found = band_wound(&Config::default(), &hand, Pose::IDENTITY, &[s], &[]).expect("limits");
        for (rest, sign) in [(found.closing, -1.0), (found.opening, 1.0)] {
            let (mut wound, mut compliance) = (s, 1.0 / hand.tendons[0].stiffness);
            for (k, &(c, r)) in hand.tendons[0].moment_arms.iter().enumerate() {
                let a = r * libm::exp(sign * exponent * (k + 1) as f64);
                wound -= r * hand.coordinates[c].rest;
                compliance += r * a / hand.coordinates[c].stiffness;
            }
            let tension = wound / compliance;
            assert!((rest.tension[0] / tension - 1.0).abs() < 1e-9, "{rest:?} {tension}");
            for (k, &(c, r)) in hand.tendons[0].moment_arms.iter().enumerate() {
                let a = r * libm::exp(sign * exponent * (k + 1) as f64);
                let due = hand.coordinates[c].rest + a * tension / hand.coordinates[c].stiffness;
                assert!((rest.q[c] - due).abs() < 1e-9, "{c} {} {due}", rest.q[c]);
            }
        }
    }

    #[test]
    fn much_friction_limits_and_saturation_have_limits_too() {
        let config = Config::default();
        for (exponent, sigma) in [(0.0, 0.5), (0.1, 0.3), (0.1, 0.9), (0.25, 0.6)] {
            let hand = softhand(exponent);
            let Band { closing, opening } =
                band(&config, &hand, Pose::IDENTITY, &[sigma], &[]).expect("limits");
            if exponent == 0.0 {
                assert_eq!(closing, opening);
            } else {
                assert!(closing.tension[0] > opening.tension[0], "{closing:?} {opening:?}");
            }
        }
    }

    #[test]
    fn dry_friction_of_a_joint_shifts_it_by_its_own_torque() {
        let mut hand = Hand::clone(&Hand::builtin("softhand").expect("it is built in"));
        let joint = hand.coordinate("index_abd").expect("it has one");
        hand.coordinates[joint].friction = 1e-3;
        let way = 1e-3 / hand.coordinates[joint].stiffness;
        let config = Config::default();
        // A slack cable, and one that is about to be taut: both have limits, and between the latter it pulls.
        let free = solve_wound(&config, &hand, Pose::IDENTITY, &[-1.0], &[]).expect("a rest");
        let found = band_wound(&config, &hand, Pose::IDENTITY, &[-1.0], &[]).expect("limits");
        let [closing, opening] = [&found.closing, &found.opening].map(|rest| rest.q[joint] - free.q[joint]);
        // The cable pulls this joint backwards.
        assert!((closing - way).abs() < 1e-12 && (opening + way).abs() < 1e-12, "{closing} {opening}");
        let taut = band_wound(&config, &hand, Pose::IDENTITY, &[0.0], &[]).expect("limits");
        assert!(taut.closing.tension[0] > 0.0 && taut.opening.tension[0] == 0.0, "{taut:?}");
    }
}
