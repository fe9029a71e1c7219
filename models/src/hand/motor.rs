//! Motors.

/// A motor: the command σ in [0, 1] maps to `s_ref = scaling · (σ − offset)`.
#[derive(Clone, Debug)]
pub struct Motor {
    /// Name, for messages.
    pub name: String,
    /// s at σ − offset = 1.
    pub scaling: f64,
    /// σ at which s_ref is 0.
    pub offset: f64,
    /// Largest |dσ/dt|, 1/s.
    pub speed_limit: f64,
}

impl Motor {
    /// s_ref at σ.
    pub fn wound(&self, sigma: f64) -> f64 {
        self.scaling * (sigma - self.offset)
    }
}
