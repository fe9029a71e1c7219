//! Dead blows: with e = 0 nothing returns, whatever the masses.
//!
//! The damper of a contact is critical for a fifth of a kilogram ([`Config::contact_dissipation_s`]). A blow of a mass m, kg,
//! stores energy in the spring besides, and an overdamped contact lets it go at `v/(4 ζ²)`. So a point that surfaces approach faster
//! than [`Config::rebound_speed`] takes the dissipation time
//!
//! `τ_b = 2 ζ √(m/k)`
//!
//! and the time runs out as it passes: τ_b falls by h in every step until it is the usual τ. Surfaces part at δ/τ_b with the overlap δ,
//! so that their speed stays the same and no force acts between them while δ and τ_b fall together. A damper only takes energy.
//!
//! A blow passes through other contacts of its island, which yield before they approach. They take such a time, too.

use crate::config::Config;
use crate::contact::narrow_phase::{ContactPoint, Contacts};
use crate::law::Law;
use crate::model::{Model, Owner};
use crate::solver::island::Island;
use crate::solver::problem::Problem;

/// Ratio ζ of the damper to the critical one.
const DAMPING: f64 = 12.0;

/// Part of its speed that a blow returns.
const RETURNED: f64 = 0.25 / (DAMPING * DAMPING);

/// A blow passes through the contacts that yield with more than this part of its speed.
const PASSED: f64 = 0.5 * RETURNED;

/// The dissipation time of such a contact is at most so many times that of its mass: harder ones make steps of a heap hard to solve.
const LONGEST: f64 = 2.0;

/// A blow that takes less than this part of the speed in its first step weighs no more than one that takes it.
const STOPPED: f64 = 0.1;

/// Dissipation time of a blow of this mass, s.
fn dissipation_s(config: &Config, mass: f64) -> f64 {
    2.0 * DAMPING * (mass / config.contact_stiffness).sqrt()
}

/// Mass of the lighter of two bodies, kg.
fn lighter(model: &Model, bodies: [Owner; 2]) -> f64 {
    let mass = |owner: Owner| match owner {
        Owner::Static => f64::INFINITY,
        Owner::Link(i) => model.hand().map_or(f64::INFINITY, |hand| hand.links[i].inertia.mass),
        Owner::Object(k) => model.objects()[k].mass,
    };
    mass(bodies[0]).min(mass(bodies[1]))
}

/// Starts the blow of two bodies' point, if they approach it fast; true if they do.
pub(super) fn strike(model: &Model, bodies: [Owner; 2], point: &mut ContactPoint) -> bool {
    let config = model.config();
    let due = point.approach < -config.rebound_speed && model.has(Law::DeadBlows);
    if due {
        let struck_s = dissipation_s(config, lighter(model, bodies));
        point.anchor.struck_s = point.anchor.struck_s.max(struck_s);
    }
    due
}

/// Speed of the fastest blow that acts in the solution of an island's step, m/s; 0 without one.
pub(super) fn fastest(config: &Config, contacts: &Contacts, island: &Island, problem: &Problem) -> f64 {
    let mut fastest: f64 = 0.0;
    if !contacts.struck || island.hand {
        return fastest;
    }
    for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
        let found = &contacts.points[contacts.pairs[index].points.clone()];
        for (point, found) in problem.points[solved.first..solved.end].iter().zip(found) {
            if found.anchor.struck_s > 0.0 && point.impulse[2] > 0.0 && found.approach < -config.rebound_speed
            {
                fastest = fastest.max(-found.approach);
            }
        }
    }
    fastest
}

/// Dissipation time of a point that bears after a step, s. `blow` is the speed of the fastest blow of the step, m/s; the point
/// has this normal `impulse`, N s, and ends at the normal velocity `after`, m/s.
#[inline]
pub(super) fn hold(
    model: &Model,
    bodies: [Owner; 2],
    point: &ContactPoint,
    blow: f64,
    after: (f64, f64),
) -> f64 {
    // Most points are in no blow.
    if point.anchor.struck_s == 0.0 && blow == 0.0 { 0.0 } else { held(model, bodies, point, blow, after) }
}

#[cold]
fn held(
    model: &Model,
    bodies: [Owner; 2],
    point: &ContactPoint,
    blow: f64,
    (impulse, after): (f64, f64),
) -> f64 {
    let config = model.config();
    let h = config.step_s;
    let mut struck_s = point.anchor.struck_s;
    if blow > 0.0 && after < -PASSED * blow {
        let own_s = dissipation_s(config, lighter(model, bodies));
        // What it yields in the step returns as slowly as the blow.
        let yielded_s = -after * h / (RETURNED * blow);
        struck_s = struck_s.max(yielded_s.clamp(own_s, LONGEST * own_s));
    }
    if struck_s > 0.0 && point.approach < -config.rebound_speed {
        // What meets may lean on other bodies.
        let own = (impulse - point.anchor.normal_force * h).max(0.0);
        let change = (after - point.approach).max(-STOPPED * point.approach);
        struck_s = struck_s.max(dissipation_s(config, own / change));
    }
    after_step(config, struck_s)
}

/// What is left of a blow's dissipation time after a step, s.
pub(super) fn after_step(config: &Config, struck_s: f64) -> f64 {
    let left = struck_s - config.step_s;
    if left > config.contact_dissipation_s { left } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Surfaces that part out of a blow's overlap δ at δ/(h + τ_b) keep their speed while the time runs out: nothing pushes them.
    #[test]
    fn surfaces_leave_a_blow_with_one_speed() {
        for step_s in [0.25e-3, 1e-3] {
            let config = Config::with_step(step_s);
            let (mut struck_s, mut overlap) = (dissipation_s(&config, 0.05), 2e-5);
            let first = overlap / (step_s + struck_s);
            let mut steps = 0;
            while struck_s > 0.0 {
                let speed = overlap / (step_s + struck_s);
                assert!((speed / first - 1.0).abs() < 1e-9, "{speed} after {steps} steps");
                overlap -= speed * step_s;
                struck_s = after_step(&config, struck_s);
                steps += 1;
            }
            // The usual law goes on from there without a push.
            let left = overlap / (step_s + config.contact_dissipation_s);
            assert!(left <= first * (1.0 + 1e-9) && steps > 1, "{left} of {first} after {steps} steps");
        }
    }

    #[test]
    fn a_blow_returns_less_than_half_a_percent_and_its_time_grows_with_the_root_of_the_mass() {
        let config = Config::default();
        let [light, heavy] = [0.05, 0.2].map(|mass| dissipation_s(&config, mass));
        assert!((heavy / light - 2.0).abs() < 1e-12);
        const { assert!(RETURNED < 5e-3) };
    }
}
