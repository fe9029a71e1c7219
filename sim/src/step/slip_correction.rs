//! The de Saxcé term: a sliding contact touches.
//!
//! Sign: normal velocities are positive where surfaces part. The convex law of friction (Castro, Permenter, Han 2022,
//! section V) lifts a contact that slips at speed s, m/s, as if its surfaces parted with μ s; the bipotential of de Saxcé
//! and Feng (1998) takes that out again: the normal velocity at which a point carries nothing is
//!
//! `v̂_n = −φ/(h + τ_n) − μ max(s − s₀, 0)`
//!
//! with the gap φ, m, the dissipation time τ_n, s, and a deadband s₀ (`Config::de_saxce_deadband`). s is that of the last
//! step. Where slip sets in or ends within a step, the term is off by μ Δs: [`correct`] takes the slip of the solution, and
//! the step is solved again.

use crate::config::Config;
use crate::contact::narrow_phase::{ContactPair, ContactPoint, Contacts};
use crate::contact::restitution::Rebound;
use crate::solver::island::Island;
use crate::solver::problem::{Point, Problem};

/// How often a step is solved again because slip changed: each pass leaves a tenth of the error or so. In islands of several objects, or
/// with the hand, the tolerance is coarser, for there something begins to slide at nearly every step.
const PASSES: usize = 2;

/// Contacts of this stiffness, N/m, hang by so little that these passes are enough. Harder ones carry nothing at a gap that
/// is smaller in proportion: a tenth for every pass more.
const SOFT_STIFFNESS: f64 = 2e5;

/// How often a step is solved again at most where rebounding surfaces slip. The first guess is right for a body that meets another
/// in one point; where it meets it in several, it takes more.
pub(super) const REBOUND_PASSES: usize = 6;

/// A rebound is as fast as it should be to this part of its slip, or m/s.
const REBOUND_TOLERANCE: f64 = 1e-3;

/// A surface that is lifted at some speed is off by as much as in this time, s, at any shorter step.
const LEAST_S: f64 = 1e-3;

/// By how much finer than usual the term's tolerance is the `pass`-th time that a step is looked at, from 0 on; `None` when it is
/// not to be solved again for the term.
pub(super) fn finer(config: &Config, pass: usize) -> Option<f64> {
    let harder = (config.contact_stiffness / SOFT_STIFFNESS).max(1.0);
    // The logarithm only where it is needed: most steps end before.
    let is_due = pass < PASSES || pass < PASSES + libm::log10(harder).ceil() as usize;
    is_due.then_some(if pass == 0 { 1.0 } else { harder })
}

/// Normal velocity at which a contact point that does not slip carries nothing, m/s, and its dissipation time, s.
pub(super) fn rest_target(config: &Config, pair: &ContactPair, point: &ContactPoint) -> (f64, f64) {
    let distance = point.distance + pair.initial_overlap;
    let tau_n = config.contact_dissipation_s * nearness(distance, config.contact_onset_m);
    (-distance / (config.step_s + tau_n), tau_n)
}

/// How much lower that velocity is for a point that slips at `slip`, m/s.
pub(super) fn de_saxce(config: &Config, pair: &ContactPair, slip: f64) -> f64 {
    pair.friction * (slip - config.de_saxce_deadband).max(0.0)
}

/// 1 for surfaces that touch, falling to 0 at a gap of `onset`: dissipation sets in without a jump, which would
/// make a contact that is about to close and open again flicker for ever.
pub(super) fn nearness(gap: f64, onset: f64) -> f64 {
    (1.0 - gap / onset).clamp(0.0, 1.0)
}

/// Gives the problem's points the term of the slip that they have in its solution, where the one they had leaves a surface
/// farther off than the tolerance, m, over `finer`; and, with or without that, those that rebound and slip at another speed than
/// was thought. True if there is any such point.
pub(super) fn correct(
    config: &Config,
    contacts: &Contacts,
    island: &Island,
    problem: &mut Problem,
    finer: Option<f64>,
) -> bool {
    let usual = if island.hand || island.objects.len() > 1 {
        config.hand_de_saxce_tolerance_m
    } else {
        config.de_saxce_tolerance_m
    };
    let alone = island.is_lone_object();
    let mut any = false;
    for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
        let pair = &contacts.pairs[index];
        let found = &contacts.points[pair.points.clone()];
        for (point, found) in problem.points[solved.first..solved.end].iter_mut().zip(found) {
            if let Some(rebound) = found.rebound {
                // Among several bodies the slip of two has to do.
                any |= alone && correct_rebound(pair.friction, &rebound, point);
                continue;
            }
            let Some(finer) = finer else { continue };
            let tolerance = usual / finer;
            let (rest, tau_n) = rest_target(config, pair, found);
            // A point that carries nothing is right to, unless the bodies still approach: its slip was taken for faster
            // than it is, and they would interpenetrate.
            let open = point.impulse[2] <= 0.0;
            if open && point.velocity[2] >= rest {
                continue;
            }
            let slip = point.law.slip_speed(point.velocity, point.impulse);
            let target = rest - de_saxce(config, pair, slip);
            // The law lifts a surface over the step and the dissipation time. What a lone object on the ground loses by
            // that is made good by the next step; solving it again would move where slip ends.
            let over_s = if island.hand { config.step_s + tau_n } else { config.step_s.max(LEAST_S) };
            if (target - point.law.target[2]).abs() * over_s > tolerance {
                point.law.target[2] = target;
                any = true;
            }
        }
    }
    any
}

/// The same of a point that rebounds: it is to come out at its own velocity, whatever it slips at.
fn correct_rebound(friction: f64, rebound: &Rebound, point: &mut Point) -> bool {
    // A point that carries nothing is right to, unless the bodies still approach: its slip was taken for faster than it is.
    let parts = point.impulse[2] <= 0.0 && point.velocity[2] >= rebound.velocity;
    if parts || !rebound.time_s.is_finite() {
        return false;
    }
    let thought = (rebound.velocity - point.law.target[2]) / friction;
    let slip = point.law.slip_speed(point.velocity, point.impulse);
    let off = slip - thought;
    if friction == 0.0 || friction * off.abs() <= REBOUND_TOLERANCE * (slip + thought).min(1.0) {
        return false;
    }
    // A target that is too low makes the impulse, and so what is left of the slip, too small.
    point.law.target[2] = rebound.velocity - friction * (thought + off * rebound.gain).max(0.0);
    true
}
