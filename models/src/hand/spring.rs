//! Springs across several joints.

use std::collections::BTreeMap;

use super::number::{Bounds, Number, numbers};

/// A spring and damper on the length `s = Σ r_i q_i`: torque `τ = −r (k (s − rest) + d ṡ)`. It is the part of E and D off their
/// diagonals: `E = diag(E_i) + Σ k r rᵀ`.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    /// Name, for messages.
    pub name: String,
    /// r: (coordinate index, entry), ascending by coordinate.
    pub arms: Vec<(usize, f64)>,
    /// Its numbers: k in N·m/rad if r has no unit, in N/m if r is in metres.
    pub numbers: SpringNumbers,
}

numbers! {
    /// The numbers of a spring.
    numbers SpringNumbers of Spring;
    /// Its numbers as far as they are stated.
    table StatedSpring;
    /// An entry of `[springs]`.
    settings SpringSettings {
        /// Its row by name of the URDF's joint.
        joints: BTreeMap<String, f64> = Number { bounds: Bounds::NotZero, ..Number::OF_TABLE },
    }
    /// Stiffness.
    stiffness: f64 = Number { unit: "f per s", bounds: Bounds::Positive, ..Number::REQUIRED },
    /// Damping.
    damping: f64 = Number { unit: "f·s per s", bounds: Bounds::NotNegative, ..Number::ZERO },
    /// Length of the relaxed spring.
    rest: f64 = Number { unit: "unit of s", ..Number::ZERO },
}

impl Spring {
    /// s(q) − rest.
    pub fn stretch(&self, q: &[f64]) -> f64 {
        self.arms.iter().map(|&(c, r)| r * q[c]).sum::<f64>() - self.rest
    }
}
