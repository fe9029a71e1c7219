//! Scalar convex terms: joint limits, the base servo, tendons and dry friction.

use super::driven::DrivenLaw;
use serde::{Deserialize, Serialize};

/// A law between a scalar velocity u and an impulse.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub enum ScalarLaw {
    /// Unilateral: impulse `max(0, (target − u) / r)`.
    Limit {
        /// 1 / r
        inverse_regularisation: f64,
        /// Velocity that returns the coordinate to its limit.
        target: f64,
    },
    /// Saturated spring-damper: `f = clamp(k (x − h u) + b (u_t − u), ±limit)`.
    Servo {
        /// Step h, s.
        h: f64,
        /// Stiffness k.
        stiffness: f64,
        /// Damping b.
        damping: f64,
        /// Error x at the start of the step.
        error: f64,
        /// Velocity of the set point u_t.
        target: f64,
        /// Largest force.
        limit: f64,
    },
    /// A cable: `f = clamp(K (x − h u) − b u, 0, f_max)`; it pulls, never pushes.
    Tendon {
        /// Step h, s.
        h: f64,
        /// Stiffness K.
        stiffness: f64,
        /// Damping b.
        damping: f64,
        /// s_ref − s(q) at the start of the step.
        error: f64,
        /// f_max
        limit: f64,
    },
    /// A cable or a drive with a motor that its load slows.
    Driven(DrivenLaw),
    /// Dry friction: `f = −clamp(f₀ + k h u, low, high)`, a stiff spring in series with a slider. Backward Euler of this law is exact,
    /// because it does not depend on the rate.
    Friction {
        /// Step h, s.
        h: f64,
        /// Stiffness k while it sticks.
        stiffness: f64,
        /// Resistance f₀ at the start of the step.
        held: f64,
        /// Least resistance: sliding backwards.
        low: f64,
        /// Largest resistance: sliding forwards.
        high: f64,
    },
}

impl ScalarLaw {
    /// Impulse at velocity u, and −d(impulse)/du.
    #[inline]
    pub fn impulse(&self, u: f64) -> (f64, f64) {
        match *self {
            ScalarLaw::Limit { inverse_regularisation: k, target } => {
                if u < target {
                    ((target - u) * k, k)
                } else {
                    (0.0, 0.0)
                }
            }
            ScalarLaw::Servo { h, stiffness, damping, error, target, limit } => {
                let f = stiffness * (error - h * u) + damping * (target - u);
                if f.abs() >= limit {
                    (h * limit * f.signum(), 0.0)
                } else {
                    (h * f, h * (h * stiffness + damping))
                }
            }
            ScalarLaw::Driven(law) => law.impulse(u),
            ScalarLaw::Tendon { h, stiffness, damping, error, limit } => {
                let f = stiffness * (error - h * u) - damping * u;
                if f <= 0.0 {
                    (0.0, 0.0)
                } else if f >= limit {
                    (h * limit, 0.0)
                } else {
                    (h * f, h * (h * stiffness + damping))
                }
            }
            ScalarLaw::Friction { h, stiffness, held, low, high } => {
                let f = held + h * stiffness * u;
                if f >= high {
                    (-h * high, 0.0)
                } else if f <= low {
                    (-h * low, 0.0)
                } else {
                    (-h * f, h * h * stiffness)
                }
            }
        }
    }
}

/// A law on one component of the generalized velocity: `u = sign · v[dof]`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct AxisTerm {
    /// Index in the hand's part of the generalized velocity.
    pub dof: usize,
    /// ±1
    pub sign: f64,
    /// The law.
    pub law: ScalarLaw,
}

/// A law on a row: `u = Σ r_i v_i`.
#[derive(Clone, Debug)]
pub struct RowTerm {
    /// (index in the hand's part of the generalized velocity, coefficient), ascending.
    pub row: Vec<(usize, f64)>,
    /// The law.
    pub law: ScalarLaw,
}

impl RowTerm {
    /// `Σ r_i v_i`
    #[inline]
    pub fn apply(&self, v: &[f64]) -> f64 {
        let mut u = 0.0;
        for &(i, r) in &self.row {
            u += r * v[i];
        }
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tendon_pulls_within_its_bounds() {
        let law = ScalarLaw::Tendon { h: 1e-3, stiffness: 300.0, damping: 0.5, error: 2e-3, limit: 2.0 };
        for k in -50..50 {
            let (impulse, curvature) = law.impulse(f64::from(k));
            assert!((0.0..=2e-3).contains(&impulse));
            assert!(curvature >= 0.0);
        }
        assert!((law.impulse(0.0).0 - 1e-3 * 0.6).abs() < 1e-15);
    }
}
