//! The de Saxcé term: it keeps a sliding contact in touch.
//!
//! Sign: normal velocities are positive where surfaces separate. The convex law of friction (Castro,
//! Permenter, Han 2022, section V) lifts a contact that slips at speed s, m/s, as if its surfaces separated
//! with μ s; the bipotential of de Saxcé and Feng (1998) removes this: the normal velocity at which a point
//! carries no load is
//!
//! `v̂_n = −φ/(h + τ_n) − μ max(s − s₀, 0)`
//!
//! with the gap φ, m, the dissipation time τ_n, s, and a deadband s₀ (`Config::de_saxce_deadband`). s is that
//! of the last step. Where slip begins or ends within a step, the term is off by μ Δs: [`correct`] takes the
//! slip of the solution, and the step is solved again.

use crate::config::Config;
use crate::contact::narrow_phase::{ContactPair, ContactPoint, Contacts};
use crate::contact::restitution::Rebound;
use crate::solver::island::Island;
use crate::solver::problem::{Point, Problem};

/// A rebound has converged when it is off by this part of its slip, or by this, m/s.
const REBOUND_TOLERANCE: f64 = 1e-3;

/// Time, s, over which the lift of a surface counts even with shorter steps.
const MIN_S: f64 = 1e-3;

/// Normal velocity at which a contact point without slip carries no load, m/s, and its dissipation time, s.
pub(super) fn rest_target(config: &Config, pair: &ContactPair, point: &ContactPoint) -> (f64, f64) {
    let distance = point.distance + pair.initial_overlap;
    let struck_s = point.anchor.struck_s;
    if struck_s > 0.0 {
        // It reaches the surface at the end of the step, and leaves an overlap slowly.
        let over_s = if distance < 0.0 { config.step_s + struck_s } else { config.step_s };
        return (-distance / over_s, struck_s);
    }
    let tau_n = config.contact_dissipation_s * nearness(distance, config.contact_onset_m);
    (-distance / (config.step_s + tau_n), tau_n)
}

/// Reduction of that velocity for a point that slips at `slip`, m/s.
pub(super) fn de_saxce(config: &Config, pair: &ContactPair, slip: f64) -> f64 {
    pair.friction * (slip - config.de_saxce_deadband).max(0.0)
}

/// 1 for surfaces that touch, falling to 0 at a gap of `onset`: dissipation sets in without a jump. A jump
/// would make a contact that is about to close and open again flicker for ever.
pub(super) fn nearness(gap: f64, onset: f64) -> f64 {
    (1.0 - gap / onset).clamp(0.0, 1.0)
}

/// Whether any point that slides, or that rebounds, has another target.
#[derive(Clone, Copy, Default)]
pub(super) struct Corrected {
    pub slip: bool,
    pub rebound: bool,
}

/// Updates the slip targets of the problem's points to the slip of its solution: where the old target leaves
/// a surface farther off than the tolerance, m, divided by `finer`; and always for rebounds whose slip
/// differs from the assumed one.
pub(super) fn correct(
    config: &Config,
    contacts: &Contacts,
    island: &Island,
    problem: &mut Problem,
    finer: Option<f64>,
) -> Corrected {
    let alone = island.is_lone_object();
    let usual = if alone { config.de_saxce_tolerance_m } else { config.hand_de_saxce_tolerance_m };
    let mut corrected = Corrected::default();
    for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
        let pair = &contacts.pairs[index];
        let found = &contacts.points[pair.points.clone()];
        for (point, found) in problem.points[solved.first..solved.end].iter_mut().zip(found) {
            if point.law.target[2] == f64::NEG_INFINITY {
                // It only passes.
                continue;
            }
            if let Some(rebound) = found.rebound {
                // With several bodies the slip of two has to suffice.
                corrected.rebound |= alone && correct_rebound(pair.friction, &rebound, point);
                continue;
            }
            let Some(finer) = finer else { continue };
            let tolerance = usual / finer;
            let (rest, tau_n) = rest_target(config, pair, found);
            // A point without load is right, unless the bodies still approach: its slip was overestimated,
            // and they would interpenetrate.
            let open = point.impulse[2] <= 0.0;
            if open && point.velocity[2] >= rest {
                continue;
            }
            let slip = point.law.slip_speed(point.velocity, point.impulse);
            let target = rest - de_saxce(config, pair, slip);
            // The law lifts a surface over the step and the dissipation time. The next step recovers the loss
            // of a lone object on the ground; solving it again would move the point where slip ends.
            let over_s = if island.hand { config.step_s + tau_n } else { config.step_s.max(MIN_S) };
            let off = target - point.law.target[2];
            if off.abs() * over_s <= tolerance {
                continue;
            }
            // A lone object keeps the tolerance. A term that jumped from the old slip to the new one would lift it in one step and
            // let it fall in the next, for as long as it slides.
            let kept = if alone { (tolerance / over_s).copysign(off) } else { 0.0 };
            point.law.target[2] = target - kept;
            corrected.slip = true;
        }
    }
    corrected
}

/// The same for a rebounding point: it must end at its own velocity with any slip.
fn correct_rebound(friction: f64, rebound: &Rebound, point: &mut Point) -> bool {
    // A point without load is right, unless the bodies still approach: its slip was overestimated.
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
    // A target that is too low makes the impulse, and so the remaining slip, too small.
    point.law.target[2] = rebound.velocity - friction * (thought + off * rebound.gain).max(0.0);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Command, Model, State, World};
    use palmares_models::Pose;
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use std::sync::Arc;

    /// Where the step is long enough that the lagged slip is off by the tolerance, between 2.5 and 2.6 ms here, a ball must not bear
    /// more than its weight in one step and less in the next.
    #[test]
    fn what_slides_bears_its_weight_in_every_step() {
        let (mu, radius) = (0.3, 0.1);
        for stiffness in [2e5, 1e7, 1e9] {
            for step_s in [1e-3, 2.5e-3, 2.55e-3, 2.6e-3, 2.7e-3, 4e-3] {
                let hard = Config {
                    contact_stiffness: stiffness,
                    anchor_stiffness: stiffness,
                    ..Config::with_step(step_s)
                };
                let mut model = Model::new(hard, None).expect("empty");
                model.add_ground(0.0, mu);
                let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius })];
                let ball = Object::new("ball", parts, 1.0, mu, 0.0).expect("sound");
                model.add_object(Arc::new(ball)).expect("it fits");
                let state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.0, 0.0, radius)]);
                let mut world = World::new(Arc::new(model), state);
                world.state_mut().v[0] = 2.0;
                let command = Command::stay(world.model(), Pose::IDENTITY);
                // It rolls after 0.19 s.
                for k in 0..(0.18 / step_s) as usize {
                    world.step(&command);
                    let weight: f64 = world.contact_forces().iter().map(|contact| contact.force.z).sum();
                    let off = weight / 9.81 - 1.0;
                    assert!(k < 30 || off.abs() < 0.02, "{stiffness} N/m, {step_s} s, step {k}: {off}");
                }
            }
        }
    }

    #[test]
    fn dissipation_sets_in_evenly_where_surfaces_come_near() {
        let onset = 1e-4;
        let found = [2e-4, 1e-4, 7.5e-5, 0.0, -1e-3].map(|gap| nearness(gap, onset));
        for (found, expected) in found.iter().zip([0.0, 0.0, 0.25, 1.0, 1.0]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }
}
