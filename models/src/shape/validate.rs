//! Checks of a shape before anything computes with it.

use super::Shape;
use super::inertia::volume;

impl Shape {
    /// Checks sizes; the error names the problem.
    ///
    /// # Errors
    /// A size that is not positive and finite, a rounding larger than its box, a hull without volume.
    pub fn validate(&self) -> Result<(), String> {
        match self {
            Shape::Sphere { radius } if positive(*radius) => Ok(()),
            Shape::Capsule { radius, half_length } | Shape::Cylinder { radius, half_length }
                if positive(*radius) && positive(*half_length) =>
            {
                Ok(())
            }
            Shape::Box { half_extents, rounding }
                if half_extents.iter().all(|&x| positive(x) && *rounding < x) && not_negative(*rounding) =>
            {
                Ok(())
            }
            Shape::Hull { points, rounding }
                if not_negative(*rounding)
                    && points.iter().flatten().all(|x| x.is_finite())
                    && volume(self) > 0.0
                    && self.to_parry().is_some() =>
            {
                Ok(())
            }
            Shape::Hull { .. } => Err("a hull's points are not finite or span no volume".to_owned()),
            Shape::Sphere { radius } => Err(format!("a sphere of radius {radius} m: {SIZES}")),
            Shape::Capsule { radius, half_length } => Err(format!(
                "a capsule of radius {radius} m, {} m between its ends: {SIZES}",
                2.0 * half_length
            )),
            Shape::Cylinder { radius, half_length } => {
                Err(format!("a cylinder of radius {radius} m and length {} m: {SIZES}", 2.0 * half_length))
            }
            Shape::Box { half_extents, rounding } => Err(format!(
                "a box of {:?} m with edges rounded by {rounding} m: {SIZES}, or not more than twice the rounding",
                half_extents.map(|x| 2.0 * x)
            )),
        }
    }
}

/// Problem with the sizes of a shape.
const SIZES: &str = "not positive and finite";

pub(crate) fn positive(x: f64) -> bool {
    x.is_finite() && x > 0.0
}

pub(crate) fn not_negative(x: f64) -> bool {
    x.is_finite() && x >= 0.0
}
