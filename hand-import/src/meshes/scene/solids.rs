//! The shapes of a scene that have a formula: as a shape of a hand where the frame allows it, and as triangles.

use std::f64::consts::{FRAC_PI_2, TAU};

use palmares_models::{Mat3, Pose, Rotation, Vec3};

use super::frame::Frame;
use super::nodes::Node;
use crate::draft::Geometry;
use crate::meshes::text::Corners;

/// Points around an axis.
const POINTS: usize = 24;
/// Rings of a ball from pole to pole.
const RINGS: usize = 12;
/// Part of a length by which edges may be off a right angle, or radii differ.
const SAME: f64 = 1e-6;

/// A shape about the origin; the axis of a cylinder or cone is y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Solid {
    /// Full edge lengths.
    Cuboid([f64; 3]),
    Ball {
        radius: f64,
    },
    Cylinder {
        radius: f64,
        height: f64,
    },
    /// Its tip is at +y.
    Cone {
        radius: f64,
        height: f64,
    },
}

impl Solid {
    /// The solid that a node is, with the defaults of its kind.
    pub(super) fn of(node: &Node) -> Result<Option<Solid>, String> {
        let size =
            |name: &str, default: f64| Ok::<_, String>(node.numbers::<1>(name)?.map_or(default, |[x]| x));
        let solid = match node.kind.as_str() {
            "Cube" => Solid::Cuboid([size("width", 2.0)?, size("height", 2.0)?, size("depth", 2.0)?]),
            "Box" => Solid::Cuboid(node.numbers("size")?.unwrap_or([2.0; 3])),
            "Sphere" => Solid::Ball { radius: size("radius", 1.0)? },
            "Cylinder" => Solid::Cylinder { radius: size("radius", 1.0)?, height: size("height", 2.0)? },
            "Cone" => Solid::Cone { radius: size("bottomRadius", 1.0)?, height: size("height", 2.0)? },
            _ => return Ok(None),
        };
        Ok(Some(solid))
    }

    /// The shape of a hand that it is in a frame, and its pose there; `None` if the frame shears it, or there is no such shape.
    pub(super) fn shape(&self, frame: &Frame) -> Option<(Pose, Geometry)> {
        let axes = [frame.linear.x_axis, frame.linear.y_axis, frame.linear.z_axis];
        let lengths = axes.map(|axis| axis.length());
        let [a, b, c] = lengths;
        let sizes = match *self {
            Solid::Cuboid(size) => size,
            Solid::Ball { radius } => [radius; 3],
            Solid::Cylinder { radius, height } | Solid::Cone { radius, height } => [radius, height, radius],
        };
        if !sizes.iter().zip(lengths).all(|(size, scale)| *size > 0.0 && (size * scale).is_finite()) {
            return None;
        }
        let off =
            [(0, 1), (0, 2), (1, 2)].map(|(i, j)| axes[i].dot(axes[j]).abs() / (lengths[i] * lengths[j]));
        // NaN, of a frame without volume, is no right angle.
        if !off.iter().all(|off| *off < SAME) {
            return None;
        }
        let same = |x: f64, y: f64| (x - y).abs() <= SAME * x.max(y);
        let [mut x, y, z] = [axes[0] / a, axes[1] / b, axes[2] / c];
        if x.cross(y).dot(z) < 0.0 {
            // A mirrored solid is the same solid.
            x = -x;
        }
        let rotation = Rotation::from_mat3(&Mat3::from_cols(x, y, z));
        let geometry = match *self {
            Solid::Cuboid([w, h, d]) => Geometry::Box([w * a, h * b, d * c]),
            Solid::Ball { radius } if same(a, b) && same(a, c) => Geometry::Sphere { radius: radius * a },
            Solid::Ball { radius } => Geometry::Ellipsoid(lengths.map(|s| s * radius)),
            Solid::Cylinder { radius, height } if same(a, c) => {
                let geometry = Geometry::Cylinder { radius: radius * a, length: height * b };
                // Its axis is z in a hand.
                let rotation = rotation * Rotation::from_axis_angle(Vec3::X, -FRAC_PI_2);
                return Some((Pose::from_parts(frame.origin, rotation), geometry));
            }
            _ => return None,
        };
        Some((Pose::from_parts(frame.origin, rotation), geometry))
    }

    /// Its triangles, outside to the left of their edges.
    pub(super) fn triangles(&self) -> Corners {
        let around = |radius: f64, y: f64, k: usize| {
            let turn = TAU * (k % POINTS) as f64 / POINTS as f64;
            Vec3::new(radius * turn.sin(), y, radius * turn.cos())
        };
        let mut corners = Vec::new();
        // Rings of radius and height, from the top to the bottom.
        let rings: Vec<(f64, f64)> = match *self {
            Solid::Cuboid(size) => {
                let half = Vec3::from_array(size) * 0.5;
                for (u, v, w) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                    for side in [-1.0, 1.0] {
                        let corner = |s: f64, t: f64| {
                            let mut p = [0.0; 3];
                            (p[u], p[v], p[w]) = (side, s * side, t);
                            Vec3::from_array(p) * half
                        };
                        let [p, q, r, s] =
                            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                        corners.extend([[p, q, r], [p, r, s]]);
                    }
                }
                return corners;
            }
            Solid::Ball { radius } => (0..=RINGS)
                .map(|ring| {
                    let (sin, cos) = (std::f64::consts::PI * ring as f64 / RINGS as f64).sin_cos();
                    (if ring % RINGS == 0 { 0.0 } else { radius * sin }, radius * cos)
                })
                .collect(),
            Solid::Cylinder { radius, height } => {
                let top = 0.5 * height;
                vec![(0.0, top), (radius, top), (radius, -top), (0.0, -top)]
            }
            Solid::Cone { radius, height } => {
                let top = 0.5 * height;
                vec![(0.0, top), (radius, -top), (0.0, -top)]
            }
        };
        for pair in rings.windows(2) {
            let [(above, top), (below, bottom)] = [pair[0], pair[1]];
            for k in 0..POINTS {
                let [p, q, r, s] = [
                    around(above, top, k),
                    around(below, bottom, k),
                    around(below, bottom, k + 1),
                    around(above, top, k + 1),
                ];
                if below > 0.0 {
                    corners.push([p, q, r]);
                }
                if above > 0.0 {
                    corners.push([p, r, s]);
                }
            }
        }
        corners
    }
}
