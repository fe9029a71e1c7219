//! The closed form of adaptive synergies: where an unobstructed hand comes to rest.
//!
//! With tendons taut, `f = A_s (s − R q₀) + B_s τ_c` and `q = q₀ + C_s (s − R q₀) + D_s τ_c` where
//! `P = (R E⁻¹ Rᵀ + K⁻¹)⁻¹`, `A_s = P`, `B_s = −P R E⁻¹`, `C_s = E⁻¹ Rᵀ P`, `D_s = E⁻¹ − E⁻¹ Rᵀ P R E⁻¹`
//! (Rocchi & Hauser 2016, eqs 4 and 5; K is the tendons' stiffness).

use nalgebra::{DMatrix, DVector};
use palmares_models::hand::Hand;

/// The matrices of the closed form for n coordinates and m tendons. Springless coordinates are refused.
#[derive(Clone, Debug)]
pub struct ClosedForm {
    /// P, m x m.
    pub p: DMatrix<f64>,
    /// C_s, n x m.
    pub c: DMatrix<f64>,
    /// D_s, n x n.
    pub d: DMatrix<f64>,
    /// R, m x n.
    pub r: DMatrix<f64>,
    /// q₀
    pub rest: DVector<f64>,
    /// E⁻¹, the diagonal.
    pub compliance: DVector<f64>,
}

/// A coordinate has no spring, so that no unique equilibrium exists.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("coordinate `{coordinate}` has stiffness {stiffness}; the closed form needs a positive one")]
pub struct NoSpring {
    /// Its name.
    pub coordinate: String,
    /// Its stiffness.
    pub stiffness: f64,
}

impl ClosedForm {
    /// Builds the matrices of a hand.
    pub fn new(hand: &Hand) -> Result<Self, NoSpring> {
        let (n, m) = (hand.coordinates.len(), hand.tendons.len());
        let mut compliance = DVector::zeros(n);
        for (i, c) in hand.coordinates.iter().enumerate() {
            if c.stiffness.is_nan() || c.stiffness <= 0.0 {
                return Err(NoSpring { coordinate: c.name.clone(), stiffness: c.stiffness });
            }
            compliance[i] = 1.0 / c.stiffness;
        }
        let mut r = DMatrix::zeros(m, n);
        for (t, tendon) in hand.tendons.iter().enumerate() {
            for &(c, arm) in &tendon.moment_arms {
                r[(t, c)] += arm;
            }
        }
        let e_inverse = DMatrix::from_diagonal(&compliance);
        let mut s = &r * &e_inverse * r.transpose();
        for (t, tendon) in hand.tendons.iter().enumerate() {
            s[(t, t)] += 1.0 / tendon.stiffness;
        }
        // Positive definite: E⁻¹ is, and every tendon adds its own compliance.
        let p = s.clone().cholesky().map_or_else(|| DMatrix::zeros(m, m), |l| l.inverse());
        let c = &e_inverse * r.transpose() * &p;
        let d = &e_inverse - &c * &r * &e_inverse;
        let rest = DVector::from_iterator(n, hand.coordinates.iter().map(|c| c.rest));
        Ok(ClosedForm { p, c, d, r, rest, compliance })
    }

    /// Coordinates and tensions at wound lengths s (m) under joint torques τ_c (n) of contacts.
    ///
    /// Holds while every tendon is taut and below its limit, and no joint is at its limit.
    pub fn solve(&self, s: &[f64], tau: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let tau = DVector::from_column_slice(tau);
        let stretch = DVector::from_column_slice(s) - &self.r * &self.rest;
        let q = &self.rest + &self.c * &stretch + &self.d * &tau;
        let f = &self.p * (&stretch - &self.r * tau.component_mul(&self.compliance));
        (q.as_slice().to_vec(), f.as_slice().to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numeric check of the adaptive-synergy model: E = diag(0.5, 0.4, 0.3), R = [1 1 1], rigid tendon.
    #[test]
    fn reproduces_the_worked_example() {
        let compliance = DVector::from_column_slice(&[2.0, 2.5, 1.0 / 0.3]);
        let r = DMatrix::from_row_slice(1, 3, &[1.0, 1.0, 1.0]);
        let e_inverse = DMatrix::from_diagonal(&compliance);
        let p = DMatrix::from_element(1, 1, 1.0 / compliance.sum());
        let c = &e_inverse * r.transpose() * &p;
        let d = &e_inverse - &c * &r * &e_inverse;
        let form = ClosedForm { p, c, d, r, rest: DVector::zeros(3), compliance };
        let (q, f) = form.solve(&[0.7], &[0.1, -0.05, 0.02]);
        for (q, expected) in q.iter().zip([0.34255319, 0.05319149, 0.30425532]) {
            assert!((q - expected).abs() < 5e-9);
        }
        assert!((f[0] - 0.0712766).abs() < 5e-8);
    }
}
