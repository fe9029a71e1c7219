//! The shapes of a run as Foxglove shows them, in JSON.

use crate::frames::{WORLD, Xyz, Xyzw, link_frame};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_tasks::Run;
use serde::Serialize;

/// sRGB of the hand.
const HAND_COLOR: [f64; 3] = [0.72, 0.74, 0.78];

/// A time or a length of time.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Time {
    sec: u64,
    nsec: u32,
}

impl Time {
    /// From ns since 1970 UTC.
    pub(crate) fn from_ns(ns: u64) -> Self {
        Time { sec: ns / 1_000_000_000, nsec: (ns % 1_000_000_000) as u32 }
    }
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Place {
    position: Xyz,
    orientation: Xyzw,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Color {
    r: f64,
    g: f64,
    b: f64,
    a: f64,
}

/// To a hundredth of a millimetre: finer is not seen, and packs worse.
const STEPS: f64 = 1e5;

fn xyz(v: Vec3) -> Xyz {
    Xyz::rounded(v, STEPS)
}

fn place(pose: Pose) -> Place {
    Place { position: xyz(pose.translation), orientation: Xyzw::rounded(pose.rotation, STEPS) }
}

#[derive(Debug, Serialize)]
struct Sized {
    pose: Place,
    size: Xyz,
    color: Color,
}

#[derive(Debug, Serialize)]
struct Cylinder {
    pose: Place,
    size: Xyz,
    bottom_scale: f64,
    top_scale: f64,
    color: Color,
}

#[derive(Debug, Serialize)]
struct Triangles {
    pose: Place,
    points: Vec<Xyz>,
    color: Color,
    colors: [Color; 0],
    indices: Vec<u32>,
}

#[derive(Debug, Serialize)]
struct Entity {
    timestamp: Time,
    frame_id: String,
    id: String,
    lifetime: Time,
    frame_locked: bool,
    metadata: [(); 0],
    cubes: Vec<Sized>,
    spheres: Vec<Sized>,
    cylinders: Vec<Cylinder>,
    triangles: Vec<Triangles>,
}

/// `foxglove.SceneUpdate`
#[derive(Debug, Serialize)]
pub(crate) struct SceneUpdate {
    deletions: [(); 0],
    entities: Vec<Entity>,
}

impl Entity {
    fn new(timestamp: Time, frame_id: &str, id: &str) -> Self {
        Entity {
            timestamp,
            frame_id: frame_id.into(),
            id: id.into(),
            lifetime: Time::default(),
            frame_locked: true,
            metadata: [],
            cubes: Vec::new(),
            spheres: Vec::new(),
            cylinders: Vec::new(),
            triangles: Vec::new(),
        }
    }

    fn add(&mut self, at: Pose, shape: &Shape, [r, g, b]: [f64; 3]) {
        let color = Color { r, g, b, a: 1.0 };
        let ball =
            |at: Pose, radius: f64| Sized { pose: place(at), size: xyz(Vec3::splat(2.0 * radius)), color };
        let cylinder = |radius: f64, half_length: f64| Cylinder {
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
            Shape::Box { half_extents, .. } => self.cubes.push(Sized {
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
                self.triangles.push(Triangles {
                    pose: place(at * upright),
                    points: points.into_iter().map(xyz).collect(),
                    color,
                    colors: [],
                    indices: faces.into_iter().flatten().collect(),
                });
            }
        }
    }
}

/// What stands in the scene.
pub(crate) fn scene(run: &Run, timestamp: Time) -> SceneUpdate {
    let mut entities = Vec::new();
    for link in &run.hand().links {
        let frame = link_frame(link);
        let mut entity = Entity::new(timestamp, &frame, &frame);
        for geom in &link.geoms {
            entity.add(geom.link_from_geom, &geom.shape, HAND_COLOR);
        }
        entities.push(entity);
    }
    for body in &run.scene().bodies {
        let frame = if body.free { body.name.as_str() } else { WORLD };
        let mut entity = Entity::new(timestamp, frame, &body.name);
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
    SceneUpdate { deletions: [], entities }
}
