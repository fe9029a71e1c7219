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

use super::narrow_phase::ContactPoint;
use crate::config::Config;

/// Ratio ζ of the damper to the critical one: the part `1/(4 ζ²)` of the speed returns, a thousandth.
const DAMPING: f64 = 16.0;

/// A blow that takes less than this part of the speed in its first step weighs no more than one that takes it.
const STOPPED: f64 = 0.1;

/// Dissipation time of a blow of this mass, s.
pub(crate) fn dissipation_s(config: &Config, mass: f64) -> f64 {
    2.0 * DAMPING * (mass / config.contact_stiffness).sqrt()
}

/// Starts the blows of points whose surfaces approach fast; `mass`, kg, is no less than what meets in them.
pub(crate) fn strike(config: &Config, points: &mut [ContactPoint], mass: impl Fn() -> f64) {
    for point in points {
        if point.approach < -config.rebound_speed {
            point.anchor.struck_s = point.anchor.struck_s.max(dissipation_s(config, mass()));
        }
    }
}

/// The same for a struck point whose blow, `impulse` beside its load, N s, has changed the normal velocity to `after`, m/s: what meets
/// in it may lean on other bodies.
pub(crate) fn weighed(config: &Config, point: &ContactPoint, impulse: f64, after: f64) -> f64 {
    let struck_s = point.anchor.struck_s;
    if point.approach >= -config.rebound_speed || struck_s == 0.0 {
        return struck_s;
    }
    let blow = impulse - point.anchor.normal_force * config.step_s;
    let change = (after - point.approach).max(-STOPPED * point.approach);
    struck_s.max(dissipation_s(config, blow.max(0.0) / change))
}

/// What is left of a blow's dissipation time after a step, s.
pub(crate) fn after_step(config: &Config, struck_s: f64) -> f64 {
    let left = struck_s - config.step_s;
    if left > config.contact_dissipation_s { left } else { 0.0 }
}
