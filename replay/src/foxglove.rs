//! The shapes of a run as `foxglove.SceneUpdate`, in JSON. Names and types are those of the published definitions
//! (<https://github.com/foxglove/foxglove-sdk/tree/main/schemas/jsonschema>); the fields that no file has are left out.

use crate::frames::{Quaternion, Vector3, WORLD, link_frame};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_tasks::Run;
use schemars::JsonSchema;
use serde::Serialize;

/// sRGB of the hand.
const HAND_COLOR: [f64; 3] = [0.72, 0.74, 0.78];

/// A time, or a duration.
#[derive(Clone, Copy, Debug, Default, Serialize, JsonSchema)]
#[schemars(rename = "FoxgloveTime")]
pub(crate) struct Time {
    sec: u64,
    #[schemars(range(max = 999_999_999))]
    nsec: u32,
}

impl Time {
    /// From ns since 1970 UTC.
    pub(crate) fn from_ns(ns: u64) -> Self {
        Time { sec: ns / 1_000_000_000, nsec: (ns % 1_000_000_000) as u32 }
    }
}

/// The pose of a shape in the frame of its entity.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
struct FoxglovePose {
    /// Position, m.
    position: Vector3,
    /// Orientation.
    orientation: Quaternion,
}

/// A colour with its opacity; each component is 0 to 1.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
struct Color {
    r: f64,
    g: f64,
    b: f64,
    a: f64,
}

/// Steps of a hundredth of a millimetre: finer ones are invisible, and compress worse.
const STEPS: f64 = 1e5;

fn xyz(v: Vec3) -> Vector3 {
    Vector3::rounded(v, STEPS)
}

fn place(pose: Pose) -> FoxglovePose {
    FoxglovePose { position: xyz(pose.translation), orientation: Quaternion::rounded(pose.rotation, STEPS) }
}

/// A box, or an ellipsoid.
#[derive(Debug, Serialize, JsonSchema)]
struct Primitive {
    pose: FoxglovePose,
    /// Extents of the box, or diameters of the ellipsoid, m.
    size: Vector3,
    color: Color,
}

/// A cylinder along z.
#[derive(Debug, Serialize, JsonSchema)]
struct CylinderPrimitive {
    pose: FoxglovePose,
    /// Diameters along x and y, and length along z, m.
    size: Vector3,
    /// Diameter of the lower end, relative to `size`.
    bottom_scale: f64,
    /// Diameter of the upper end, relative to `size`.
    top_scale: f64,
    color: Color,
}

/// Triangles.
#[derive(Debug, Serialize, JsonSchema)]
struct TriangleListPrimitive {
    pose: FoxglovePose,
    /// Corners, m.
    points: Vec<Vector3>,
    color: Color,
    /// The colour of each corner; empty: `color` for all.
    colors: Vec<Color>,
    /// Three indices into `points` for each triangle.
    indices: Vec<u32>,
}

/// A remark on an entity; none is written.
#[derive(Debug, Serialize, JsonSchema)]
struct KeyValuePair {
    key: String,
    value: String,
}

/// A body: a link of the hand, an object or furniture.
#[derive(Debug, Serialize, JsonSchema)]
struct SceneEntity {
    timestamp: Time,
    /// The frame that the entity is fixed in.
    frame_id: String,
    /// Identifies the entity.
    id: String,
    /// Zero: as long as the file.
    lifetime: Time,
    /// Whether the entity follows its frame.
    frame_locked: bool,
    metadata: Vec<KeyValuePair>,
    cubes: Vec<Primitive>,
    spheres: Vec<Primitive>,
    cylinders: Vec<CylinderPrimitive>,
    triangles: Vec<TriangleListPrimitive>,
}

/// The removal of an entity; none is written.
#[derive(Debug, Serialize, JsonSchema)]
struct SceneEntityDeletion {
    timestamp: Time,
    r#type: u32,
    id: String,
}

/// The shapes of all bodies.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct SceneUpdate {
    deletions: Vec<SceneEntityDeletion>,
    entities: Vec<SceneEntity>,
}

impl SceneEntity {
    fn new(timestamp: Time, frame_id: &str, id: &str) -> Self {
        SceneEntity {
            timestamp,
            frame_id: frame_id.into(),
            id: id.into(),
            lifetime: Time::default(),
            frame_locked: true,
            metadata: Vec::new(),
            cubes: Vec::new(),
            spheres: Vec::new(),
            cylinders: Vec::new(),
            triangles: Vec::new(),
        }
    }

    fn add(&mut self, at: Pose, shape: &Shape, [r, g, b]: [f64; 3]) {
        let color = Color { r, g, b, a: 1.0 };
        let ball = |at: Pose, radius: f64| Primitive {
            pose: place(at),
            size: xyz(Vec3::splat(2.0 * radius)),
            color,
        };
        let cylinder = |radius: f64, half_length: f64| CylinderPrimitive {
            pose: place(at),
            size: xyz(Vec3::new(2.0 * radius, 2.0 * radius, 2.0 * half_length)),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color,
        };
        match shape {
            Shape::Sphere { radius } => self.spheres.push(ball(at, *radius)),
            Shape::Cylinder { radius, half_length } => self.cylinders.push(cylinder(*radius, *half_length)),
            Shape::Capsule { radius, half_length } => {
                self.cylinders.push(cylinder(*radius, *half_length));
                for z in [-half_length, *half_length] {
                    let end = at * Pose::from_translation(Vec3::new(0.0, 0.0, z));
                    self.spheres.push(ball(end, *radius));
                }
            }
            Shape::Box { half_extents, .. } => self.cubes.push(Primitive {
                pose: place(at),
                size: xyz(Vec3::from_array(half_extents.map(|x| 2.0 * x))),
                color,
            }),
            Shape::Hull { .. } => {
                let Some((solid, upright)) = shape.to_parry() else { return };
                let sharp = solid.as_convex_polyhedron();
                let polyhedron = sharp.or_else(|| solid.as_round_convex_polyhedron().map(|s| &s.inner_shape));
                let Some((points, faces)) = polyhedron.map(|polyhedron| polyhedron.to_trimesh()) else {
                    return;
                };
                self.triangles.push(TriangleListPrimitive {
                    pose: place(at * upright),
                    points: points.into_iter().map(xyz).collect(),
                    color,
                    colors: Vec::new(),
                    indices: faces.into_iter().flatten().collect(),
                });
            }
        }
    }
}

/// The bodies of a run.
pub(crate) fn scene(run: &Run, timestamp: Time) -> SceneUpdate {
    let mut entities = Vec::new();
    for link in &run.hand().links {
        let frame = link_frame(link);
        let mut entity = SceneEntity::new(timestamp, &frame, &frame);
        for geom in &link.geoms {
            entity.add(geom.link_from_geom, &geom.shape, HAND_COLOR);
        }
        entities.push(entity);
    }
    for body in &run.scene().bodies {
        let frame = if body.free { body.name.as_str() } else { WORLD };
        let mut entity = SceneEntity::new(timestamp, frame, &body.name);
        let pose = |position: [f64; 3], [x, y, z, w]: [f64; 4]| {
            Pose::from_parts(Vec3::from_array(position), Rotation::from_xyzw(x, y, z, w))
        };
        let body_pose = match (body.position, body.quat_xyzw) {
            (Some(position), Some(quat_xyzw)) if !body.free => pose(position, quat_xyzw),
            _ => Pose::IDENTITY,
        };
        for part in &body.parts {
            entity.add(body_pose * pose(part.position, part.quat_xyzw), &part.shape, body.color);
        }
        entities.push(entity);
    }
    SceneUpdate { deletions: Vec::new(), entities }
}
