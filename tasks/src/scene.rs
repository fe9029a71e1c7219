//! What stands in the world at tick 0, as told to the client.

use crate::sensing::Sensing;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use parry3d_f64::bounding_volume::BoundingVolume;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Everything a controller needs to know about the world, sent in the reply to `reset`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scene {
    /// Fixed and free bodies. Free ones come first, in the order of `truth.objects`.
    pub bodies: Vec<SceneBody>,
    /// Named regions the rules speak of.
    pub regions: Vec<Region>,
    /// m/s²
    pub gravity: [f64; 3],
}

/// A body and its shapes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SceneBody {
    /// Index in the scene.
    pub id: usize,
    /// Unique name: `ball_3`, `box_a`.
    pub name: String,
    /// False for furniture.
    pub free: bool,
    /// A horizontal ground that goes on for ever: its surface is the top of its one part, which shows some of it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub endless: bool,
    /// kg; 0 for furniture.
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub com: [f64; 3],
    /// Coulomb friction coefficient of two surfaces like this one; two bodies have the geometric mean of theirs.
    pub friction: f64,
    /// Position at tick 0, m; not told of free bodies when the run's sensing is `sensors`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Orientation at tick 0, x, y, z, w; told or not as the position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quat_xyzw: Option<[f64; 4]>,
    /// Convex parts in the body frame.
    pub parts: Vec<ScenePart>,
    /// sRGB, for viewers.
    pub color: [f64; 3],
}

impl Scene {
    /// What a controller is told: with `sensors` all but where the free bodies are.
    pub fn redacted_for(mut self, sensing: Sensing) -> Self {
        if sensing == Sensing::Sensors {
            for body in self.bodies.iter_mut().filter(|body| body.free) {
                (body.position, body.quat_xyzw) = (None, None);
            }
        }
        self
    }
}

impl SceneBody {
    /// Half the lengths of the box around its parts along the axes of its own frame, m; zero for one without parts.
    pub fn half_extents(&self) -> [f64; 3] {
        let boxes = self.parts.iter().filter_map(|part| {
            let (shape, in_part) = part.shape.to_parry()?;
            let [x, y, z, w] = part.quat_xyzw;
            let pose = Pose::from_parts(Vec3::from_array(part.position), Rotation::from_xyzw(x, y, z, w));
            Some(shape.compute_aabb(&(pose * in_part)))
        });
        boxes.reduce(|a, b| a.merged(&b)).map_or([0.0; 3], |around| around.half_extents().to_array())
    }
}

/// A convex part of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScenePart {
    /// In the body frame, m.
    pub position: [f64; 3],
    /// x, y, z, w
    pub quat_xyzw: [f64; 4],
    /// Geometry.
    pub shape: Shape,
}

/// An axis-aligned region of space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Region {
    /// `box_a`, `box_b`.
    pub name: String,
    /// The part it plays in the rules: `start`, `goal`; none for others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub role: Option<String>,
    /// m
    pub min: [f64; 3],
    /// m
    pub max: [f64; 3],
}
