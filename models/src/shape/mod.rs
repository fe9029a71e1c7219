//! Collision shapes, shared by the solver, the files and the wire.

pub mod hull;
pub mod inertia;
pub(crate) mod support;
pub(crate) mod validate;

use parry3d_f64::shape::SharedShape;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Pose, Rotation, Vec3};

/// A convex shape centred on its own frame. Lengths in m. The axis of cylinders and capsules is z.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// All points within `radius` of the centre.
    Sphere {
        /// m
        radius: f64,
    },
    /// All points within `radius` of a segment of half length `half_length` along z.
    Capsule {
        /// m
        radius: f64,
        /// m, without the caps
        half_length: f64,
    },
    /// Right circular cylinder along z.
    Cylinder {
        /// m
        radius: f64,
        /// m
        half_length: f64,
    },
    /// Axis-aligned box; `rounding` is the radius of its edges, inside the stated extents.
    Box {
        /// m, including the rounding
        half_extents: [f64; 3],
        /// m
        #[serde(default)]
        rounding: f64,
    },
    /// Convex hull of points, grown by `rounding`.
    Hull {
        /// m
        points: Vec<[f64; 3]>,
        /// m
        #[serde(default)]
        rounding: f64,
    },
}

impl Shape {
    /// The same shape with all lengths scaled by a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Shape {
        match self {
            Shape::Sphere { radius } => Shape::Sphere { radius: radius * factor },
            Shape::Capsule { radius, half_length } => {
                Shape::Capsule { radius: radius * factor, half_length: half_length * factor }
            }
            Shape::Cylinder { radius, half_length } => {
                Shape::Cylinder { radius: radius * factor, half_length: half_length * factor }
            }
            Shape::Box { half_extents, rounding } => {
                Shape::Box { half_extents: half_extents.map(|x| x * factor), rounding: rounding * factor }
            }
            Shape::Hull { points, rounding } => Shape::Hull {
                points: points.iter().map(|point| point.map(|x| x * factor)).collect(),
                rounding: rounding * factor,
            },
        }
    }

    /// The parry shape and the rotation to it (the axis of parry's cylinders and capsules is y). `None` if a
    /// hull's points span no volume.
    pub fn to_parry(&self) -> Option<(SharedShape, Pose)> {
        let upright = Pose::from_parts(Vec3::ZERO, Rotation::from_rotation_x(core::f64::consts::FRAC_PI_2));
        Some(match self {
            Shape::Sphere { radius } => (SharedShape::ball(*radius), Pose::IDENTITY),
            Shape::Capsule { radius, half_length } => {
                (SharedShape::capsule_z(*half_length, *radius), Pose::IDENTITY)
            }
            Shape::Cylinder { radius, half_length } => {
                (SharedShape::cylinder(*half_length, *radius), upright)
            }
            Shape::Box { half_extents: [x, y, z], rounding } => {
                let r = *rounding;
                let shape = if r > 0.0 {
                    SharedShape::round_cuboid(x - r, y - r, z - r, r)
                } else {
                    SharedShape::cuboid(*x, *y, *z)
                };
                (shape, Pose::IDENTITY)
            }
            Shape::Hull { points, rounding } => {
                let points: Vec<Vec3> = points.iter().map(|p| Vec3::from_array(*p)).collect();
                let shape = if *rounding > 0.0 {
                    SharedShape::round_convex_hull(&points, *rounding)?
                } else {
                    SharedShape::convex_hull(&points)?
                };
                (shape, Pose::IDENTITY)
            }
        })
    }
}
