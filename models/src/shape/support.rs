//! Support points: the points of a body that are farthest along a direction.

use core::f64::consts::PI;

use crate::Vec3;

/// Point `i` of `n` spread evenly over the unit sphere along a Fibonacci spiral.
pub(crate) fn fibonacci_direction(i: usize, n: usize) -> Vec3 {
    let z = 1.0 - 2.0 * (i as f64 + 0.5) / n as f64;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let golden_angle = PI * (3.0 - 5.0_f64.sqrt());
    let (sin, cos) = libm::sincos(golden_angle * i as f64);
    Vec3::new(r * cos, r * sin, z)
}

/// The point farthest along `direction`; the first of several.
pub(crate) fn support(points: &[Vec3], direction: Vec3) -> Option<Vec3> {
    let mut best: Option<(f64, Vec3)> = None;
    for &p in points {
        let height = p.dot(direction);
        if best.is_none_or(|(h, _)| height > h) {
            best = Some((height, p));
        }
    }
    best.map(|(_, p)| p)
}
