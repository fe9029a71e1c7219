//! Contact law: projection onto the regularised friction cone.
//!
//! The impulse γ minimises `½ (γ − y)ᵀ R (γ − y)` over the cone `|γ_t| ≤ μ γ_n` with `y = R⁻¹ (v̂ − v)`,
//! R = diag(r_t, r_t, r_n, r_t) (Castro, Permenter, Han 2022, section IV-B). Axes: two tangents, normal, spin.
//!
//! A point that is a small round patch resists spin as well. With the arm a, m, at which its friction acts,
//! spin is the velocity `a ω·n` and γ_t has three components; the third is the torque about the normal
//! divided by a. The limit surface is the ellipsoid of Howe and Cutkosky (1996): `|f|² + (τ/a)² ≤ (μ f_n)²`.

use palmares_models::Vec3;

/// Slip up to this part of the displacement of the anchor is rounding.
const SLIP_ROUNDING: f64 = 1e-12;

/// Regularised Coulomb law of one contact point.
#[derive(Clone, Copy, Debug)]
pub struct ConeLaw {
    /// Coulomb friction coefficient μ.
    pub friction: f64,
    /// 1 / r_t, kg.
    pub tangential: f64,
    /// 1 / r_n, kg.
    pub normal: f64,
    /// v̂, m/s.
    pub target: [f64; 4],
    /// Arm of friction against spin, m; 0 for a point without extent.
    pub arm: f64,
    /// μ r_t / r_n: slope of the polar cone in the metric R.
    slope: f64,
    /// 1 / (1 + μ · slope)
    shrink: f64,
}

/// Hessian of ℓ in contact axes.
#[derive(Clone, Copy, Debug)]
pub enum ConeHessian {
    /// No contact force.
    Open,
    /// Inside the cone: diag(1/r_t, 1/r_t, 1/r_n, 1/r_t).
    Stick,
    /// On the cone; (t1t1, t1t2, t2t2, t1n, t2n, nn), then those of spin (t1s, t2s, ns, ss).
    Slip([f64; 6], [f64; 4]),
}

impl ConeLaw {
    /// A law from friction coefficient, 1/r_t, 1/r_n and v̂.
    pub fn new(friction: f64, tangential: f64, normal: f64, [t1, t2, n]: [f64; 3]) -> Self {
        let slope = friction * normal / tangential;
        let (target, shrink) = ([t1, t2, n, 0.0], 1.0 / (1.0 + friction * slope));
        ConeLaw { friction, tangential, normal, target, arm: 0.0, slope, shrink }
    }

    /// The same law with resistance to spin at an arm, m, and the spin's v̂, m/s.
    #[must_use]
    pub fn with_spin(mut self, arm: f64, target: f64) -> Self {
        (self.arm, self.target[3]) = (arm, target);
        self
    }

    /// Impulse γ at contact velocity `v` (N·s), and the Hessian of the term.
    #[inline]
    pub fn impulse(&self, v: [f64; 4]) -> ([f64; 4], ConeHessian) {
        let y0 = (self.target[0] - v[0]) * self.tangential;
        let y1 = (self.target[1] - v[1]) * self.tangential;
        let yn = (self.target[2] - v[2]) * self.normal;
        let ys = (self.target[3] - v[3]) * self.tangential;
        let squared = y0 * y0 + y1 * y1 + ys * ys;
        let mu = self.friction;
        if yn > 0.0 && squared <= mu * mu * yn * yn {
            return ([y0, y1, yn, ys], ConeHessian::Stick);
        }
        let yr = squared.sqrt();
        let (slope, k) = (self.slope, self.shrink);
        if yn <= -slope * yr {
            return ([0.0; 4], ConeHessian::Open);
        }
        let gn = (yn + slope * yr) * k;
        if yr == 0.0 {
            return ([0.0, 0.0, gn, 0.0], ConeHessian::Stick);
        }
        let (t0, t1, ts) = (y0 / yr, y1 / yr, ys / yr);
        let gt = mu * gn;
        let along = mu * slope * k * self.tangential;
        let across = gt / yr * self.tangential;
        let coupling = mu * k * self.normal;
        let hessian = [
            along * t0 * t0 + across * (t1 * t1 + ts * ts),
            (along - across) * t0 * t1,
            along * t1 * t1 + across * (t0 * t0 + ts * ts),
            coupling * t0,
            coupling * t1,
            k * self.normal,
        ];
        let spin = [
            (along - across) * t0 * ts,
            (along - across) * t1 * ts,
            coupling * ts,
            along * ts * ts + across * (t0 * t0 + t1 * t1),
        ];
        ([gt * t0, gt * t1, gn, gt * ts], ConeHessian::Slip(hessian, spin))
    }

    /// Slip speed at contact velocity `v` and impulse γ, m/s: the part that the elastic law does not explain,
    /// also for a point without load. It is limited to the surfaces' own speed: an anchor that yields because
    /// its load fades does not slide.
    #[inline]
    pub fn slip_speed(&self, v: [f64; 4], gamma: [f64; 4]) -> f64 {
        let (a, b, s) = (self.target[0] - v[0], self.target[1] - v[1], self.target[3] - v[3]);
        let wanted = (a * a + b * b + s * s).sqrt();
        let held = gamma[0] * gamma[0] + gamma[1] * gamma[1] + gamma[3] * gamma[3];
        let elastic = held.sqrt() / self.tangential;
        let speed = (v[0] * v[0] + v[1] * v[1] + v[3] * v[3]).sqrt();
        let slip = wanted - elastic;
        // A sticking point must not slip by rounding: its anchor would yield a little in every step.
        if slip <= SLIP_ROUNDING * wanted { 0.0 } else { slip.min(speed) }
    }

    /// `wᵀ H w`.
    #[inline]
    pub fn curvature(&self, hessian: &ConeHessian, w: [f64; 4]) -> f64 {
        match hessian {
            ConeHessian::Open => 0.0,
            ConeHessian::Stick => {
                self.tangential * (w[0] * w[0] + w[1] * w[1] + w[3] * w[3]) + self.normal * w[2] * w[2]
            }
            ConeHessian::Slip(h, s) => {
                h[0] * w[0] * w[0]
                    + h[2] * w[1] * w[1]
                    + h[5] * w[2] * w[2]
                    + 2.0 * (h[1] * w[0] * w[1] + h[3] * w[0] * w[2] + h[4] * w[1] * w[2])
                    + w[3] * (2.0 * (s[0] * w[0] + s[1] * w[1] + s[2] * w[2]) + s[3] * w[3])
            }
        }
    }
}

/// Rolling resistance of a pair: `ℓ(ω)` is Huber's function with slope `limit`, of the turn ω across the normal.
///
/// The limit is lever · normal impulse of the last step, so that the term stays convex and separable.
#[derive(Clone, Copy, Debug, Default)]
pub struct RollingLaw {
    /// Largest resisting angular impulse, N·m·s.
    pub limit: f64,
    /// Relative angular speed at which it is reached, rad/s.
    pub deadband: f64,
    /// Unit normal of the pair: spin about it does not count as rolling.
    pub normal: Vec3,
}

impl RollingLaw {
    /// The rolling part of a relative angular velocity, rad/s.
    #[inline]
    pub fn rolling(&self, omega: Vec3) -> Vec3 {
        omega - self.normal * omega.dot(self.normal)
    }

    /// Angular impulse on body B at a relative angular velocity from [`Self::rolling`], and (isotropic,
    /// radial) curvature: `H = isotropic · (I − n nᵀ) − radial · ω ωᵀ`.
    #[inline]
    pub fn impulse(&self, omega: Vec3) -> (Vec3, f64, f64) {
        let squared = omega.length_squared();
        if squared <= self.deadband * self.deadband {
            let k = self.limit / self.deadband;
            return (omega * -k, k, 0.0);
        }
        let speed = squared.sqrt();
        let k = self.limit / speed;
        (omega * -k, k, k / (speed * speed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> ConeLaw {
        ConeLaw::new(0.7, 3.0, 2.0, [0.01, -0.02, 0.05]).with_spin(0.01, 0.03)
    }

    /// γ and its Hessian must equal the numerical derivatives of ℓ, by quadrature of −γ along a ray.
    #[test]
    fn hessian_is_the_derivative_of_the_impulse() {
        for v in [
            [0.0; 4],
            [0.3, -0.2, 0.01, 0.0],
            [0.02, 0.4, 0.2, -0.3],
            [0.0, 0.0, 1.0, 0.1],
            [0.2, 0.1, -0.3, 0.6],
            [0.01, -0.02, -0.3, 0.4],
        ] {
            let (_, hessian) = law().impulse(v);
            for axis in 0..4 {
                let e = 1e-7;
                let (mut plus, mut minus) = (v, v);
                plus[axis] += e;
                minus[axis] -= e;
                let (gp, _) = law().impulse(plus);
                let (gm, _) = law().impulse(minus);
                let mut w = [0.0; 4];
                w[axis] = 1.0;
                let numeric = -(gp[axis] - gm[axis]) / (2.0 * e);
                assert!((law().curvature(&hessian, w) - numeric).abs() < 1e-5, "{v:?} axis {axis}");
            }
        }
    }

    #[test]
    fn impulse_stays_in_the_cone_and_never_pulls() {
        for i in 0..1000 {
            let f = |k: f64| libm::sin(f64::from(i) * k) * 0.5;
            let (g, _) = law().impulse([f(1.1), f(2.3), f(0.7), f(3.1)]);
            assert!(g[2] >= 0.0);
            assert!((g[0] * g[0] + g[1] * g[1] + g[3] * g[3]).sqrt() <= 0.7 * g[2] + 1e-12);
        }
    }

    #[test]
    fn rolling_resistance_is_bounded_and_opposes() {
        let law = RollingLaw { limit: 0.3, deadband: 0.01, normal: Vec3::Z };
        for speed in [1e-4, 0.01, 5.0] {
            let (t, ..) = law.impulse(Vec3::new(speed, 0.0, 0.0));
            assert!(t.x < 0.0 && t.length() <= 0.3 + 1e-15);
        }
    }
}
