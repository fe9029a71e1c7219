//! The world at tick 0, as clients get it.

use crate::sensing::Sensing;
use crate::task::GoalInfo;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use parry3d_f64::bounding_volume::BoundingVolume;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The world at tick 0, in the reply to `reset`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scene {
    /// All bodies: free ones first, in the order of `truth.objects`.
    pub bodies: Vec<SceneBody>,
    /// Regions that the rules refer to.
    pub regions: Vec<Region>,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Goals of the task with their points and tolerances, in the order in which they are reached.
    #[serde(default)]
    pub goals: Vec<GoalInfo>,
}

impl Scene {
    /// Names of the goals, in their order, where each is one of an object; empty where objects are counted instead.
    pub fn goal_names(&self) -> Vec<String> {
        self.goals.iter().filter(|goal| goal.object.is_some()).map(|goal| goal.name.clone()).collect()
    }
}

/// A body and its shapes, in the world frame at tick 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SceneBody {
    /// Index in the scene.
    pub id: usize,
    /// Unique name, such as `ball_3` or `box_a`.
    pub name: String,
    /// False for furniture.
    pub free: bool,
    /// Infinite horizontal ground: its surface is the top of its only part, a box that is for drawing.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub endless: bool,
    /// Mass, kg; 0 for furniture.
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub com: [f64; 3],
    /// Coulomb coefficient between two such surfaces; two bodies have the geometric mean of theirs.
    pub friction: f64,
    /// Origin, m; absent for free bodies in a run with sensing `sensors`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Orientation, x, y, z, w; absent where the position is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quat_xyzw: Option<[f64; 4]>,
    /// Convex parts in the body frame.
    pub parts: Vec<ScenePart>,
    /// sRGB, 0 to 1.
    pub color: [f64; 3],
}

impl Scene {
    /// The scene as a controller gets it: with `sensors` without the poses of free bodies.
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
    /// Origin in the body frame, m.
    pub position: [f64; 3],
    /// Orientation, x, y, z, w.
    pub quat_xyzw: [f64; 4],
    /// Shape, centred on its own frame.
    pub shape: Shape,
}

/// An axis-aligned region that the rules refer to, such as the inside of `box_b`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Region {
    /// Name, such as `box_b`.
    pub name: String,
    /// Role in the rules: `start` or `goal`; absent for others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub role: Option<String>,
    /// Lower corner, m.
    pub min: [f64; 3],
    /// Upper corner, m.
    pub max: [f64; 3],
}
