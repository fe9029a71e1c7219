//! Resolution of a sensor.

/// The multiple of `step` nearest to `x`. Halfway between two, it is the one farther from zero.
pub(crate) fn quantised(x: f64, step: f64) -> f64 {
    let steps = x / step;
    // A cast, since not every processor has an instruction for `round`.
    if steps.abs() < 1e15 { (steps + 0.5f64.copysign(steps)) as i64 as f64 * step } else { x }
}
