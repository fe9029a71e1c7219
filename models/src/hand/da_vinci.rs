//! A tendon over two pulleys, one on either side of a joint.

use super::length::Length;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Positions and radii of the pulleys of a [`DaVinci`] mechanism, m. Frame: that of the finger's first
/// phalanx with its joint at the origin, x along the phalanx, y to the side it bends to; the second joint is
/// at `(l1, 0)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DaVinciGeometry {
    /// Radius of the pulley on the first joint, the unit of the tendon's length: s is in rad there.
    pub r0: f64,
    /// Radius of the pulley on the first phalanx.
    pub r1: f64,
    /// Radius of the pulley on the second phalanx.
    pub r2: f64,
    /// Centre of the pulley on the first phalanx, x.
    pub a1: f64,
    /// Centre of the pulley on the first phalanx, y.
    pub b1: f64,
    /// Length of the first phalanx, joint to joint.
    pub l1: f64,
    /// Centre of the pulley on the second phalanx from the second joint, x at θ = 0.
    pub a2: f64,
    /// Centre of the pulley on the second phalanx from the second joint, y at θ = 0.
    pub b2: f64,
}

/// The tendon of a two-phalanx finger between its two pulleys (the 2016 challenge's `DaVinci` transmission).
///
/// With `r = r2 − r1`, the vector `d(θ)` from the first pulley's centre to the second's, the free length
/// `l = √(d² − r²)` of the tangent and its direction `φ = ∠d + atan2(r, l)`, the cable's length is
/// `L = l + r φ + (2 r1 − r2) θ`, and `s = (L(0) − L(θ)) / r0`: bending winds the cable in.
#[derive(Clone, Copy, Debug)]
pub struct DaVinci {
    geometry: DaVinciGeometry,
    /// L(0), m.
    at_zero: f64,
}

impl DaVinci {
    /// Checks that the pulleys never overlap, so that the length is smooth for every angle.
    ///
    /// # Errors
    /// The problem of the geometry.
    pub fn new(geometry: DaVinciGeometry) -> Result<Self, String> {
        let g = &geometry;
        let numbers = [g.r0, g.r1, g.r2, g.a1, g.b1, g.l1, g.a2, g.b2];
        if !numbers.iter().all(|x| x.is_finite()) || g.r0 <= 0.0 || g.r1 < 0.0 || g.r2 < 0.0 {
            return Err("places must be finite, r0 positive, r1 and r2 not negative".to_owned());
        }
        let long = |x: f64, y: f64| (x * x + y * y).sqrt();
        let (fixed, moving) = (long(g.l1 - g.a1, g.b1), long(g.a2, g.b2));
        if (fixed - moving).abs() <= (g.r2 - g.r1).abs() {
            return Err(format!(
                "the pulleys, {fixed} and {moving} m from the joint, come closer than their radii allow"
            ));
        }
        let mut mechanism = DaVinci { geometry, at_zero: 0.0 };
        mechanism.at_zero = mechanism.cable(0.0).value;
        Ok(mechanism)
    }

    /// The mechanism with all lengths of s, which is in units of `r0`, multiplied by a positive factor.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        DaVinci { geometry: DaVinciGeometry { r0: self.geometry.r0 / factor, ..self.geometry }, ..*self }
    }

    /// Its pulleys.
    pub fn geometry(&self) -> &DaVinciGeometry {
        &self.geometry
    }

    /// s(θ) in rad of the first joint, and its derivatives; θ is the angle of the second joint.
    pub fn length(&self, theta: f64) -> Length {
        let cable = self.cable(theta);
        let scale = -1.0 / self.geometry.r0;
        Length {
            value: scale * (cable.value - self.at_zero),
            slope: scale * cable.slope,
            curvature: scale * cable.curvature,
        }
    }

    /// L(θ), m, and its derivatives.
    fn cable(&self, theta: f64) -> Length {
        let g = &self.geometry;
        let (sin, cos) = libm::sincos(theta);
        let r = g.r2 - g.r1;
        // From the first pulley's centre to the second joint, and on to the second pulley's centre.
        let (cx, cy) = (g.l1 - g.a1, -g.b1);
        let (px, py) = (g.a2 * cos - g.b2 * sin, g.a2 * sin + g.b2 * cos);
        let (a, b) = (cx + px, cy + py);
        let squared = a * a + b * b;
        let l = (squared - r * r).sqrt();
        // ½ d(d²)/dθ and its derivative; p' = (−py, px).
        let half = cy * px - cx * py;
        let half_slope = -(cx * px + cy * py);
        let (l1, l2) = (half / l, (half_slope - half * half / (l * l)) / l);
        // ∠d relative to the longer of the two levers, where it never passes ±π/2: ψ' = d × d' / d².
        let angle = if cx * cx + cy * cy > px * px + py * py {
            libm::atan2(cx * b - cy * a, cx * a + cy * b)
        } else {
            theta + libm::atan2(px * b - py * a, px * a + py * b)
        };
        let turn = (a * px + b * py) / squared;
        let turn_slope = half * (1.0 - 2.0 * turn) / squared;
        // β = atan2(r, l): β' = −r l' / d².
        let beta_slope = -r * l1 / squared;
        let beta_curvature = -r * (l2 - 2.0 * half * l1 / squared) / squared;
        let straight = 2.0 * g.r1 - g.r2;
        Length {
            value: l + r * (angle + libm::atan2(r, l)) + straight * theta,
            slope: l1 + r * (turn + beta_slope) + straight,
            curvature: l2 + r * (turn_slope + beta_curvature),
        }
    }
}
