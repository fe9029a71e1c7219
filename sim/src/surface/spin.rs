//! Torque about its normal that a contact of round or soft shapes holds, as if it were a small disc.
//!
//! A contact pressed with N, N, spreads over a patch of radius a, m. The mean distance of friction from its
//! middle, weighted with the pressure, is the arm at which it holds spin: `τ ≤ μ N · arm`.
//!
//! - Hertz (1882), round bodies of radius R and modulus E*: `a³ = 3 N R/(4 E*)`, pressure `√(1 − r²/a²)`, arm `3π/16 a`.
//! - A layer of thickness t and modulus E on something hard (Winkler; Johnson, *Contact Mechanics*, 1985, section 4.3):
//!   `a⁴ = 4 N R t/(π E)`, pressure `1 − r²/a²`, arm `8/15 a`.
//! - A stated lever of torsional friction ρ, m: `arm = ρ/μ`.
//!
//! No arm is longer than the smaller shape: a patch does not extend beyond it, whatever lever is stated.
//!
//! Shapes that touch with flat faces do not need it: their points lie at distances from each other and hold the
//! torque by themselves.

use palmares_models::hand::Pad;
use palmares_models::shape::Shape;
use std::f64::consts::PI;

/// Contribution of a shape's surface to the torque that its contacts hold.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpinSurface {
    /// Lever of torsional friction, m.
    pub lever: f64,
    /// Thickness of a soft layer over its modulus, m/Pa.
    pub layer: f64,
    /// One over the modulus of a soft body, 1/Pa.
    pub bulk: f64,
    /// One over the radius of a ball, cylinder or capsule, 1/m; 0 for flat faces.
    pub curvature: f64,
    /// Distance of the farthest point of the shape from its middle, m.
    pub reach: f64,
}

impl SpinSurface {
    /// Surface of a shape with this reach, m, with a stated lever, m, or a pad.
    pub fn new(shape: &Shape, reach: f64, lever: f64, pad: Option<Pad>) -> Self {
        let curvature = match shape {
            Shape::Sphere { radius } | Shape::Cylinder { radius, .. } | Shape::Capsule { radius, .. } => {
                1.0 / radius
            }
            Shape::Box { .. } | Shape::Hull { .. } => 0.0,
        };
        let (layer, bulk) = match pad {
            Some(Pad { thickness: Some(thickness), modulus }) => (thickness / modulus, 0.0),
            Some(Pad { thickness: None, modulus }) => (0.0, 1.0 / modulus),
            None => (0.0, 0.0),
        };
        SpinSurface { lever, layer, bulk, curvature, reach }
    }
}

/// Law by which two surfaces resist spin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinLaw {
    /// Arm at any load, m.
    least: f64,
    /// Arm of a pad at 1 N, m.
    pad: f64,
    /// Whether the pad is a layer: its arm grows with the fourth root of the load, that of a body with the
    /// third.
    layered: bool,
    /// Largest arm, m.
    most: f64,
}

impl SpinLaw {
    /// Law of two surfaces with a friction coefficient; `None` if neither holds any torque.
    pub fn between(a: &SpinSurface, b: &SpinSurface, friction: f64) -> Option<Self> {
        let lever = a.lever.max(b.lever);
        let (layer, bulk) = (a.layer + b.layer, a.bulk + b.bulk);
        let curvature = a.curvature + b.curvature;
        // Two flat faces are a patch anyway, and without friction there is no torque.
        let soft = (layer > 0.0 || bulk > 0.0) && curvature > 0.0;
        if friction <= 0.0 || !(lever > 0.0 || soft) {
            return None;
        }
        let radius = 1.0 / curvature;
        let pad = match (soft, layer > 0.0) {
            (false, _) => 0.0,
            (true, true) => 8.0 / 15.0 * (4.0 * radius * layer / PI).sqrt().sqrt(),
            (true, false) => 3.0 * PI / 16.0 * libm::cbrt(0.75 * radius * bulk),
        };
        let most = a.reach.min(b.reach);
        Some(SpinLaw { least: (lever / friction).min(most), pad, layered: layer > 0.0, most })
    }

    /// Arm under a normal force, N; m.
    #[inline]
    pub fn arm(&self, force: f64) -> f64 {
        if self.pad == 0.0 {
            return self.least;
        }
        let growth = if self.layered { force.sqrt().sqrt() } else { libm::cbrt(force) };
        self.least.max((self.pad * growth).min(self.most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: Shape = Shape::Sphere { radius: 0.01 };

    /// Torque over μ N a by quadrature of a pressure over a disc of radius 1.
    fn mean_arm(pressure: impl Fn(f64) -> f64) -> f64 {
        let (mut torque, mut force) = (0.0, 0.0);
        let n = 100_000;
        for k in 0..n {
            let r = (f64::from(k) + 0.5) / f64::from(n);
            torque += pressure(r) * r * r;
            force += pressure(r) * r;
        }
        torque / force
    }

    #[test]
    fn arms_are_those_of_the_pressures() {
        let flat = SpinSurface { reach: 1.0, ..SpinSurface::default() };
        let soft = |thickness| Some(Pad { thickness, modulus: 1e6 });
        let layer = SpinSurface::new(&BALL, 0.01, 0.0, soft(Some(2e-3)));
        let body = SpinSurface::new(&BALL, 0.01, 0.0, soft(None));
        for force in [0.5, 20.0] {
            // Indentation of the layer by δ: a² = 2 R δ, and the pressure E δ(r)/t adds up to the force.
            let a = (4.0 * force * 0.01 * 2e-3 / (PI * 1e6)).powf(0.25);
            let delta = a * a / 0.02;
            assert!((PI * a * a * 0.5 * delta * 1e6 / 2e-3 / force - 1.0).abs() < 1e-12);
            let arm = SpinLaw::between(&layer, &flat, 0.5).expect("soft").arm(force);
            assert!((arm / (a * mean_arm(|r| 1.0 - r * r)) - 1.0).abs() < 1e-6, "{arm}");
            // Hertz: p₀ = 3 N/(2 π a²) = 2 E* a/(π R).
            let a = (0.75 * force * 0.01 / 1e6).cbrt();
            assert!((1.5 * force / (PI * a * a) / (2.0 * 1e6 * a / (PI * 0.01)) - 1.0).abs() < 1e-12);
            let arm = SpinLaw::between(&flat, &body, 0.5).expect("soft").arm(force);
            assert!((arm / (a * mean_arm(|r| (1.0 - r * r).sqrt())) - 1.0).abs() < 1e-6, "{arm}");
        }
    }

    #[test]
    fn hard_flat_and_slippery_contacts_hold_none() {
        let pad = Some(Pad { thickness: Some(2e-3), modulus: 1e6 });
        let cube = Shape::Box { half_extents: [0.01; 3], rounding: 0.0 };
        let surface = |shape, lever, pad| SpinSurface::new(shape, 0.01, lever, pad);
        let (hard, flat) = (surface(&BALL, 0.0, None), surface(&cube, 0.0, pad));
        assert_eq!(SpinLaw::between(&hard, &hard, 0.5), None);
        assert_eq!(SpinLaw::between(&flat, &flat, 0.5), None);
        assert_eq!(SpinLaw::between(&surface(&BALL, 1e-3, pad), &flat, 0.0), None);
        // A ball on a flat pad flattens it, and a stated lever is torque over force.
        assert!(SpinLaw::between(&hard, &flat, 0.5).is_some_and(|law| law.arm(10.0) > 0.0));
        let stated = SpinLaw::between(&surface(&BALL, 1e-3, None), &hard, 0.5).expect("stated");
        assert!((0.5 * stated.arm(3.0) - 1e-3).abs() < 1e-18);
    }

    #[test]
    fn no_arm_is_longer_than_the_smaller_shape() {
        let soft = Some(Pad { thickness: Some(1.0), modulus: 1e-9 });
        let large = SpinSurface { reach: 1.0, ..SpinSurface::default() };
        for (surface, friction) in [
            (SpinSurface::new(&BALL, 0.01, 1e300, None), 0.5),
            (SpinSurface::new(&BALL, 0.01, 1e-3, None), 1e-300),
            (SpinSurface::new(&BALL, 0.01, 0.0, soft), 0.5),
        ] {
            let law = SpinLaw::between(&surface, &large, friction).expect("it holds spin");
            assert_eq!(law.arm(1e3), 0.01);
        }
    }
}
