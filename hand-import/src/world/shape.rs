//! Geometry of a world's bodies: primitives of `.geom` files and meshes, in the frame of the body.

use std::path::Path;

use palmares_models::pieces::TriangleMesh;
use palmares_models::{Pose, Rotation, Vec3};

use crate::meshes::{self, ellipsoid};
use crate::numbers::numbers;
use crate::read::klampt::rotation::rotation;
use crate::source::{Source, limits};

/// The geometry of a body.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    Sphere {
        center: Vec3,
        radius: f64,
    },
    /// At its middle.
    Box {
        pose: Pose,
        size: Vec3,
    },
    /// At its middle, along z.
    Cylinder {
        pose: Pose,
        radius: f64,
        height: f64,
    },
    /// Corners of triangles.
    Mesh(Vec<[Vec3; 3]>),
}

/// x ↦ R (s ∘ x) + t, as Klamp't transforms geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    pub(super) rotation: Rotation,
    pub(super) scale: Vec3,
    pub(super) translation: Vec3,
}

impl Transform {
    pub(super) const IDENTITY: Transform =
        Transform { rotation: Rotation::IDENTITY, scale: Vec3::ONE, translation: Vec3::ZERO };

    /// First a scale and a translation, then this one.
    pub(super) fn after(self, scale: Vec3, translation: Vec3) -> Transform {
        Transform {
            rotation: self.rotation,
            scale: self.scale * scale,
            translation: self.rotation * (self.scale * translation) + self.translation,
        }
    }

    fn point(&self, p: Vec3) -> Vec3 {
        self.rotation * (self.scale * p) + self.translation
    }

    /// The factor along all axes, if it is one.
    fn uniform(&self) -> Option<f64> {
        let Vec3 { x, y, z } = self.scale;
        (x == y && y == z && x > 0.0).then_some(x)
    }
}

impl Shape {
    /// The shape in another frame.
    pub(super) fn transformed(&self, t: &Transform) -> Shape {
        if let Shape::Mesh(corners) = self {
            return Shape::Mesh(corners.iter().map(|triangle| triangle.map(|p| t.point(p))).collect());
        }
        let Some(factor) = t.uniform() else {
            return Shape::Mesh(self.triangles()).transformed(t).simplest();
        };
        let placed = |pose: &Pose| Pose::from_parts(t.point(pose.translation), t.rotation * pose.rotation);
        match self {
            Shape::Sphere { center, radius } => {
                Shape::Sphere { center: t.point(*center), radius: radius * factor }
            }
            Shape::Box { pose, size } => Shape::Box { pose: placed(pose), size: *size * factor },
            Shape::Cylinder { pose, radius, height } => {
                Shape::Cylinder { pose: placed(pose), radius: radius * factor, height: height * factor }
            }
            Shape::Mesh(_) => self.clone(),
        }
    }

    /// A mesh that is a box along the axes as that box.
    pub(super) fn simplest(self) -> Shape {
        let Shape::Mesh(corners) = &self else { return self };
        match box_of(&corners.concat()) {
            Some((low, high)) if (high - low).min_element() > 0.0 => Shape::Box {
                pose: Pose::from_parts((low + high) * 0.5, Rotation::IDENTITY),
                size: high - low,
            },
            _ => self,
        }
    }

    /// Triangles of its surface; round ones are approximated.
    pub(super) fn triangles(&self) -> Vec<[Vec3; 3]> {
        const SIDES: u32 = 48;
        let hull = |points: Vec<Vec3>| {
            let hull = TriangleMesh::hull(&points);
            hull.map(|hull| hull.triangles.iter().map(|&t| hull.corners(t)).collect()).unwrap_or_default()
        };
        match self {
            Shape::Sphere { center, radius } => {
                ellipsoid([*radius; 3]).into_iter().map(|triangle| triangle.map(|p| p + *center)).collect()
            }
            Shape::Box { pose, size } => hull(corners(*size * -0.5, *size * 0.5).map(|p| *pose * p).to_vec()),
            Shape::Cylinder { pose, radius, height } => hull(
                (0..2 * SIDES)
                    .map(|k| {
                        let angle = std::f64::consts::TAU * f64::from(k / 2) / f64::from(SIDES);
                        let z = if k % 2 == 0 { 0.5 } else { -0.5 } * height;
                        *pose * Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
                    })
                    .collect(),
            ),
            Shape::Mesh(corners) => corners.clone(),
        }
    }

    /// Lowest and highest corner of the box around it along the axes, where the body is at a pose.
    pub(super) fn bounds(&self, world_from_body: &Pose) -> (Vec3, Vec3) {
        let around = |center: Vec3, half: Vec3| (center - half, center + half);
        match self {
            Shape::Sphere { center, radius } => around(*world_from_body * *center, Vec3::splat(*radius)),
            Shape::Cylinder { pose, radius, height } => {
                let there = *world_from_body * *pose;
                let axis = there.rotation * Vec3::Z;
                let half = |along: f64, others: [f64; 2]| {
                    0.5 * height * along.abs() + radius * others[0].hypot(others[1])
                };
                let Vec3 { x, y, z } = axis;
                let half = Vec3::new(half(x, [y, z]), half(y, [x, z]), half(z, [x, y]));
                around(there.translation, half)
            }
            Shape::Box { pose, size } => {
                let there = *world_from_body * *pose;
                extent(&corners(*size * -0.5, *size * 0.5).map(|p| there * p))
            }
            Shape::Mesh(triangles) => {
                extent(&triangles.iter().flatten().map(|p| *world_from_body * *p).collect::<Vec<_>>())
            }
        }
    }
}

/// Lowest and highest coordinates of points.
pub(super) fn extent(points: &[Vec3]) -> (Vec3, Vec3) {
    points.iter().fold((Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY)), |(low, high), p| {
        (low.min(*p), high.max(*p))
    })
}

/// The corners of a box.
fn corners(low: Vec3, high: Vec3) -> [Vec3; 8] {
    let pick = |k: usize, bit: usize, low: f64, high: f64| if k & bit == 0 { low } else { high };
    std::array::from_fn(|k| {
        Vec3::new(pick(k, 1, low.x, high.x), pick(k, 2, low.y, high.y), pick(k, 4, low.z, high.z))
    })
}

/// Ends of the box along the axes whose corners all points are, and that has a point at each; one side of it may be 0: a plate.
pub(super) fn box_of(points: &[Vec3]) -> Option<(Vec3, Vec3)> {
    // Of the largest side: files turn by 1.57 where they mean a quarter turn.
    const EXACT: f64 = 1e-3;
    let (low, mut high) = extent(points);
    let near = EXACT * (high - low).max_element();
    let flat = (high - low).to_array().map(|side| side <= near);
    if flat.iter().filter(|flat| **flat).count() > 1 {
        return None;
    }
    for (k, _) in flat.iter().enumerate().filter(|(_, flat)| **flat) {
        high[k] = low[k];
    }
    let all = corners(low, high);
    let is = |a: &Vec3, b: &Vec3| (*a - *b).abs().max_element() <= near;
    let whole = points.iter().all(|p| all.iter().any(|corner| is(p, corner)))
        && all.iter().all(|corner| points.iter().any(|p| is(p, corner)));
    whole.then_some((low, high))
}

/// The shape in a file of geometry.
///
/// # Errors
/// Its problem, as the end of a sentence that begins with the file.
pub(super) fn of_file(source: &Source, path: &Path) -> Result<Shape, String> {
    let bytes = source.bytes(path, "geometry", limits().mesh_bytes).map_err(|error| error.to_string())?;
    let kind = path.extension().map(|kind| kind.to_string_lossy().to_lowercase()).unwrap_or_default();
    match kind.as_str() {
        "geom" => primitive(&String::from_utf8_lossy(&bytes)),
        "pcd" => Err("is a cloud of points, which has no surface; save it as a mesh".to_owned()),
        _ => Ok(Shape::Mesh(meshes::triangles(&bytes, path, source)?.corners).simplest()),
    }
}

/// A primitive, as KrisLibrary's `GeometricPrimitive3D` reads it.
fn primitive(text: &str) -> Result<Shape, String> {
    let valid = "valid are `Primitive` and then Sphere, Box, AABB or Cylinder with their numbers";
    let mut words = text.split_whitespace().filter(|word| *word != "Primitive");
    let kind = words.next().unwrap_or_default();
    let list = numbers(&words.collect::<Vec<_>>().join(" ")).unwrap_or_default();
    let v = |k: usize| Vec3::new(list[k], list[k + 1], list[k + 2]);
    match (kind, list.len()) {
        ("Sphere", 4) => Ok(Shape::Sphere { center: v(0), radius: list[3] }),
        ("AABB", 6) => {
            let pose = Pose::from_parts((v(0) + v(3)) * 0.5, Rotation::IDENTITY);
            Ok(Shape::Box { pose, size: v(3) - v(0) })
        }
        // A corner, three axes and the lengths along them.
        ("Box", 15) => {
            let rotation = rotation([v(3), v(6), v(9)]).ok_or("has a Box whose axes are no rotation")?;
            Ok(Shape::Box { pose: Pose::from_parts(v(0) + rotation * (v(12) * 0.5), rotation), size: v(12) })
        }
        // The middle of the base, the axis, radius and height.
        ("Cylinder", 8) => {
            let axis = v(3).try_normalize().ok_or("has a Cylinder whose axis is 0")?;
            let rotation = Rotation::from_rotation_arc(Vec3::Z, axis);
            Ok(Shape::Cylinder {
                pose: Pose::from_parts(v(0) + axis * (0.5 * list[7]), rotation),
                radius: list[6],
                height: list[7],
            })
        }
        (kind, n) => Err(format!("has the primitive '{kind}' with {n} numbers; {valid}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primitives_are_where_klampt_has_them() {
        let bounds = |text: &str| primitive(text).expect("read").bounds(&Pose::IDENTITY);
        assert_eq!(
            bounds("Primitive\nSphere\n1 2 3  0.5"),
            (Vec3::new(0.5, 1.5, 2.5), Vec3::new(1.5, 2.5, 3.5))
        );
        assert_eq!(bounds("Primitive AABB 0 0 0 1 2 3"), (Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)));
        // Its x axis is the world's y.
        let (low, high) = bounds("Primitive Box 1 0 0  0 1 0  -1 0 0  0 0 1  2 1 3");
        assert!((low - Vec3::ZERO).length() < 1e-12 && (high - Vec3::new(1.0, 2.0, 3.0)).length() < 1e-12);
        let (low, high) = bounds("Primitive Cylinder 0 0 1  1 0 0  0.2 0.6");
        assert!((low - Vec3::new(0.0, -0.2, 0.8)).length() < 1e-12);
        assert!((high - Vec3::new(0.6, 0.2, 1.2)).length() < 1e-12);
        assert!(
            primitive("Primitive Ellipsoid 1 2 3")
                .is_err_and(|text| text.contains("'Ellipsoid' with 3 numbers"))
        );
    }

    #[test]
    fn a_scale_turns_with_the_frame() {
        let turned = Rotation::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let t = Transform { rotation: turned, scale: Vec3::new(2.0, 1.0, 1.0), translation: Vec3::X };
        let cube = Shape::Box { pose: Pose::IDENTITY, size: Vec3::ONE };
        let Shape::Box { pose, size } = cube.transformed(&t) else { panic!("no box") };
        assert!((pose.translation - Vec3::X).length() < 1e-12);
        assert!((size - Vec3::new(1.0, 2.0, 1.0)).length() < 1e-12);
        // A part of the file's own place comes first: (1, 0, 0) goes to R (2, 0, 0) + (1, 0, 0).
        let whole = t.after(Vec3::splat(3.0), Vec3::X);
        assert!((whole.point(Vec3::ZERO) - Vec3::new(1.0, 2.0, 0.0)).length() < 1e-12);
        assert!((whole.point(Vec3::X) - Vec3::new(1.0, 8.0, 0.0)).length() < 1e-12);
    }

    #[test]
    fn only_the_corners_of_a_box_are_one() {
        let all = corners(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(box_of(&all), Some((Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0))));
        assert_eq!(box_of(&all[1..]), None);
        let mut hollow = all.to_vec();
        hollow.push(Vec3::new(0.5, 1.0, 1.5));
        assert_eq!(box_of(&hollow), None);
        assert_eq!(box_of(&all[..4]), Some((Vec3::ZERO, Vec3::new(1.0, 2.0, 0.0))));
        assert_eq!(box_of(&all[..2]), None);
    }
}
