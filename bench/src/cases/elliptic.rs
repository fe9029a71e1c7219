//! Elliptic integrals of the first kind, for the periods of pendulums and tumbling bodies.

/// K(k), by the arithmetic-geometric mean: `π / (2 agm(1, k'))`.
pub(crate) fn complete(modulus: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - modulus * modulus).sqrt());
    // Converges quadratically; a fixed number of turns is more than f64 needs.
    for _ in 0..12 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    std::f64::consts::FRAC_PI_2 / a
}

/// F(φ, k) for |φ| ≤ π/2, by Carlson's symmetric integral: `sin φ · R_F(cos² φ, 1 − k² sin² φ, 1)`
/// (Carlson 1979, "Computing elliptic integrals by duplication").
pub(crate) fn incomplete(phi: f64, modulus: f64) -> f64 {
    let (sin, cos) = phi.sin_cos();
    let (mut x, mut y, mut z) = (cos * cos, 1.0 - (modulus * sin).powi(2), 1.0f64);
    // Every duplication brings the arguments four times nearer to their mean.
    for _ in 0..30 {
        let l = x.sqrt() * y.sqrt() + y.sqrt() * z.sqrt() + z.sqrt() * x.sqrt();
        (x, y, z) = (0.25 * (x + l), 0.25 * (y + l), 0.25 * (z + l));
    }
    sin / ((x + y + z) / 3.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz & Stegun, tables 17.1 and 17.5.
    #[test]
    fn tabulated_values() {
        assert!((complete(0.0) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((complete(0.5f64.sqrt()) - 1.854_074_677_301_372).abs() < 1e-14);
        let thirty = 30f64.to_radians();
        assert!((incomplete(thirty, thirty.sin()) - 0.529_428_627).abs() < 1e-8);
        assert!((incomplete(std::f64::consts::FRAC_PI_2, 0.9) - complete(0.9)).abs() < 1e-13);
    }
}
