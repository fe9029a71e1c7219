//! Springs across several joints.

/// A spring and damper on the length `s = Σ r_i q_i`: torque `τ = −r (k (s − rest) + d ṡ)`. It is the part of E and D off their
/// diagonals: `E = diag(E_i) + Σ k r rᵀ`.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    /// Name, for messages.
    pub name: String,
    /// r: (coordinate index, entry), ascending by coordinate.
    pub arms: Vec<(usize, f64)>,
    /// k: N·m/rad if r has no unit, N/m if r is in metres.
    pub stiffness: f64,
    /// d
    pub damping: f64,
    /// s of the relaxed spring.
    pub rest: f64,
}

impl Spring {
    /// s(q) − rest.
    pub fn stretch(&self, q: &[f64]) -> f64 {
        self.arms.iter().map(|&(c, r)| r * q[c]).sum::<f64>() - self.rest
    }
}
