//! The parts of an object in a file, and their convex shapes.

use serde::Deserialize;

use crate::shape::Shape;
use crate::{Pose, Rotation, Vec3, rotation};

/// Largest extent of an object, m.
pub(super) const MAX_EXTENT_M: f64 = 1.0;
/// Largest friction coefficient of an object: as for furniture.
pub(super) const MAX_FRICTION: f64 = 1e3;
/// Largest mass of an object, kg.
pub(super) const MAX_MASS_KG: f64 = 20.0;
/// Largest number of convex parts of an object.
pub(super) const MAX_PARTS: usize = 64;

/// A part in a file: full sizes, m; angles, rad.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum ObjectPart {
    Sphere {
        radius: f64,
        #[serde(default)]
        at: [f64; 3],
        /// Without effect.
        #[serde(default)]
        rpy: [f64; 3],
    },
    Box {
        size: [f64; 3],
        #[serde(default)]
        at: [f64; 3],
        #[serde(default)]
        rpy: [f64; 3],
    },
    Cylinder {
        radius: f64,
        height: f64,
        #[serde(default)]
        at: [f64; 3],
        #[serde(default)]
        rpy: [f64; 3],
    },
    /// All points within `radius` of the segment between two ends.
    Capsule {
        radius: f64,
        ends: [[f64; 3]; 2],
        #[serde(default)]
        at: [f64; 3],
        #[serde(default)]
        rpy: [f64; 3],
    },
    /// The wall of a vessel: a ring of slabs whose bottom is at `at`, with outer radii at the bottom and at
    /// the top.
    Wall {
        sides: usize,
        bottom: f64,
        top: f64,
        height: f64,
        thickness: f64,
        #[serde(default)]
        at: [f64; 3],
        #[serde(default)]
        rpy: [f64; 3],
    },
    /// The convex hull of points.
    Hull {
        points: Vec<[f64; 3]>,
        #[serde(default)]
        at: [f64; 3],
        #[serde(default)]
        rpy: [f64; 3],
    },
    /// The convex hull of an STL file next to the task, its edges rounded.
    Mesh {
        file: String,
        #[serde(default = "one")]
        scale: [f64; 3],
        /// Edge radius; 0 keeps the hull's corners.
        rounding: Option<f64>,
        #[serde(default)]
        at: [f64; 3],
        #[serde(default)]
        rpy: [f64; 3],
    },
}

fn one() -> [f64; 3] {
    [1.0; 3]
}

fn finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|x| x.is_finite() && x.abs() <= MAX_EXTENT_M * 10.0)
}

/// Pose of a part in the object's frame.
pub(super) fn place(at: &[f64; 3], rpy: &[f64; 3]) -> Result<Pose, String> {
    if finite(at) && finite(rpy) {
        Ok(Pose::from_parts(Vec3::from_array(*at), rotation::from_rpy(*rpy)))
    } else {
        Err("its place is not finite or too far away".to_owned())
    }
}

impl ObjectPart {
    /// Poses and shapes, or the problem. A mesh is not allowed here.
    pub(super) fn solids(&self) -> Result<Vec<(Pose, Shape)>, String> {
        Ok(match self {
            ObjectPart::Sphere { radius, at, rpy } => {
                vec![(place(at, rpy)?, Shape::Sphere { radius: *radius })]
            }
            ObjectPart::Box { size, at, rpy } => {
                let half_extents = size.map(|x| 0.5 * x);
                vec![(place(at, rpy)?, Shape::Box { half_extents, rounding: 0.0 })]
            }
            ObjectPart::Cylinder { radius, height, at, rpy } => {
                let shape = Shape::Cylinder { radius: *radius, half_length: 0.5 * height };
                vec![(place(at, rpy)?, shape)]
            }
            ObjectPart::Capsule { radius, ends: [a, b], at, rpy } => {
                let _ = (place(a, &[0.0; 3])?, place(b, &[0.0; 3])?);
                let (a, b) = (Vec3::from_array(*a), Vec3::from_array(*b));
                let along = b - a;
                let length = along.length();
                if length < 1e-6 {
                    return Err("its ends are the same point; a sphere has no ends".to_owned());
                }
                let shape = Shape::Capsule { radius: *radius, half_length: 0.5 * length };
                let own = Pose::from_parts((a + b) * 0.5, from_z_to(along / length));
                let placed = place(at, rpy)?;
                // A capsule without a pose keeps its bits.
                vec![(if placed == Pose::IDENTITY { own } else { placed * own }, shape)]
            }
            ObjectPart::Wall { sides, bottom, top, height, thickness, at, rpy } => {
                if !(3..=MAX_PARTS).contains(sides) {
                    return Err(format!("sides = {sides}; 3 to {MAX_PARTS} are possible"));
                }
                if !(*height > 0.0 && *thickness > 0.0 && bottom.min(*top) > *thickness) {
                    return Err(
                        "height and thickness must be positive, the radii above the thickness".to_owned()
                    );
                }
                wall(*sides, *bottom, *top, *height, *thickness, place(at, rpy)?)
            }
            ObjectPart::Hull { points, at, rpy } => {
                if !(4..=MAX_POINTS).contains(&points.len()) || !points.iter().all(|p| finite(p)) {
                    return Err(format!(
                        "it has {} points; 4 to {MAX_POINTS} finite ones are possible",
                        points.len()
                    ));
                }
                vec![(place(at, rpy)?, Shape::Hull { points: points.clone(), rounding: 0.0 })]
            }
            ObjectPart::Mesh { file, .. } => {
                return Err(format!("it names mesh '{file}', but has no folder"));
            }
        })
    }
}

/// Largest number of points of a hull.
const MAX_POINTS: usize = 256;

/// The shortest turn of z to a unit vector.
fn from_z_to(d: Vec3) -> Rotation {
    if d.z < -1.0 + 1e-12 {
        return Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0);
    }
    Rotation::from_xyzw(-d.y, d.x, 0.0, 1.0 + d.z).normalize()
}

fn wall(sides: usize, bottom: f64, top: f64, height: f64, thickness: f64, at: Pose) -> Vec<(Pose, Shape)> {
    let step = core::f64::consts::TAU / sides as f64;
    let lean = libm::atan2(top - bottom, height);
    let slant = libm::sqrt(height * height + (top - bottom) * (top - bottom));
    // The slab is as wide as the outer polygon's side halfway up.
    let middle = 0.5 * (bottom + top);
    let half_width = middle * libm::tan(0.5 * step);
    let half_extents = [0.5 * thickness, half_width, 0.5 * slant];
    let (s, c) = libm::sincos(lean);
    // Its middle lies behind the middle of the outer face, by half the thickness.
    let slab = Vec3::new(middle - 0.5 * thickness * c, 0.0, 0.5 * height + 0.5 * thickness * s);
    (0..sides)
        .map(|k| {
            let yaw = step * k as f64;
            let turned = Pose::from_parts(Vec3::ZERO, rotation::from_rpy([0.0, 0.0, yaw]));
            let leaned = Pose::from_parts(slab, rotation::from_rpy([0.0, lean, 0.0]));
            (at * turned * leaned, Shape::Box { half_extents, rounding: 0.0 })
        })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// docs/tasks.md: "Parts, each with `at` and `rpy`".
    #[test]
    fn each_part_has_a_place() {
        for shape in [
            "shape = 'sphere'\nradius = 0.01",
            "shape = 'box'\nsize = [0.01, 0.02, 0.03]",
            "shape = 'cylinder'\nradius = 0.01\nheight = 0.02",
            "shape = 'capsule'\nradius = 0.01\nends = [[0.01, 0.0, 0.0], [0.03, 0.0, 0.02]]",
            "shape = 'wall'\nsides = 5\nbottom = 0.04\ntop = 0.05\nheight = 0.1\nthickness = 0.004",
            "shape = 'hull'\npoints = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]]",
        ] {
            let solids = |place: &str| {
                toml::from_str::<ObjectPart>(&format!("{shape}\n{place}")).unwrap().solids().unwrap()
            };
            let moved = solids("at = [0.1, 0.0, 0.0]\nrpy = [0.0, 0.0, 1.5707963267948966]");
            let by = place(&[0.1, 0.0, 0.0], &[0.0, 0.0, core::f64::consts::FRAC_PI_2]).unwrap();
            for ((plain, a), (found, b)) in solids("").iter().zip(&moved) {
                let expected = by * *plain;
                assert!((expected.translation - found.translation).length() < 1e-15, "{shape}");
                assert!((expected.rotation * found.rotation.inverse()).xyz().length() < 1e-15, "{shape}");
                assert_eq!(a, b);
            }
        }
    }
}
