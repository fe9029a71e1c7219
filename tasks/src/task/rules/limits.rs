//! Valid numbers of rules.

/// Speed below which an object counts as at rest, m/s; carried objects move with the hand.
pub(crate) const REST_SPEED: f64 = 5e-3;

/// Maximum size of points, so that a score can be written as a decimal number.
pub(super) const MAX_POINTS: f64 = 1e6;

/// Checks points that may be negative.
pub(super) fn points(field: &str, x: f64) -> Result<(), String> {
    if x.abs() <= MAX_POINTS {
        return Ok(());
    }
    Err(format!("rules.{field} = {x}; it must be in [-{MAX_POINTS}, {MAX_POINTS}]"))
}

/// Checks a number that must be positive.
pub(super) fn positive(field: &str, x: f64) -> Result<(), String> {
    let fine = x.is_finite() && x > 0.0;
    if fine { Ok(()) } else { Err(format!("rules.{field} = {x}; it must be positive and finite")) }
}

/// Checks the settling time.
pub(super) fn settle_s(x: f64) -> Result<(), String> {
    let fine = (0.0..=60.0).contains(&x);
    if fine { Ok(()) } else { Err(format!("rules.settle_s = {x}; it must be in [0, 60]")) }
}
