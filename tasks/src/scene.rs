//! What stands in the world at tick 0, as told to the client.

use palmares_models::shape::Shape;
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
    /// kg; 0 for furniture.
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub com: [f64; 3],
    /// Coulomb friction coefficient of two surfaces like this one; two bodies have the geometric mean of theirs.
    pub friction: f64,
    /// Pose at tick 0.
    pub position: [f64; 3],
    /// x, y, z, w
    pub quat_xyzw: [f64; 4],
    /// Convex parts in the body frame.
    pub parts: Vec<ScenePart>,
    /// sRGB, for viewers.
    pub color: [f64; 3],
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
