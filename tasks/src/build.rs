//! From a task and a seed to a world at rest.

use crate::scene::{Region, Scene, SceneBody, ScenePart};
use crate::seed::Seed;
use crate::settle::pour;
use crate::task::{Slab, Task};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, Config, Model, Owner, State, World};
use std::sync::Arc;

/// Longest time the world is given to come to rest after pouring, s.
const REST_S: f64 = 3.0;

/// Why a scene could not be built.
#[derive(Debug, thiserror::Error)]
#[error("task `{task}`: {message}")]
pub struct SceneError {
    /// Name of the task.
    pub task: String,
    /// What went wrong.
    pub message: String,
}

/// A world at tick 0 and how it is told to a client.
pub struct Built {
    /// The world, its objects at rest.
    pub world: World,
    /// The same in words.
    pub scene: Scene,
    /// Name of the body of every collider, in the model's order.
    pub body_names: Vec<String>,
}

/// Where the hand's base starts.
pub fn start_pose(task: &Task) -> Pose {
    let [x, y, z, w] = task.hand.quat_xyzw;
    Pose::from_parts(Vec3::from_array(task.hand.position), Rotation::from_xyzw(x, y, z, w).normalize())
}

/// Builds the scene: furniture, boxes and poured objects, with or without a hand.
pub fn build(task: &Task, hand: Option<Arc<Hand>>, seed: Seed) -> Result<Built, SceneError> {
    let failed = |message: String| SceneError { task: task.name.clone(), message };
    let config = Config::with_step(task.step_s);
    let centers = pour(task, seed);
    let object = &task.objects;
    let mut model = Model::new(config.clone(), hand.clone()).map_err(|e| failed(e.to_string()))?;
    let furniture = add_furniture(task, &mut model).map_err(|e| failed(e.to_string()))?;
    let mut bodies = Vec::new();
    for (k, center) in centers.iter().enumerate() {
        let name = format!("{}_{k}", object.name);
        let parts = vec![(Pose::IDENTITY, object.shape.clone())];
        let built = Object::new(&name, parts, object.mass, object.friction, object.rolling_friction)
            .map_err(|e| failed(e.to_string()))?;
        model.add_object(Arc::new(built)).map_err(|e| failed(e.to_string()))?;
        bodies.push(SceneBody {
            id: k,
            name,
            free: true,
            mass: object.mass,
            friction: object.friction,
            position: center.to_array(),
            quat_xyzw: [0.0, 0.0, 0.0, 1.0],
            parts: vec![part(Vec3::ZERO, object.shape.clone())],
            color: object.color,
        });
    }
    let model = Arc::new(model);
    let poses: Vec<Pose> = centers.iter().map(|c| Pose::from_translation(*c)).collect();
    let base = start_pose(task);
    let mut world = World::new(Arc::clone(&model), State::at_rest(&model, base, &poses));
    // The pile was poured by another engine with its own contact law: let it find its rest in this one.
    let wait = Command::stay(&model, base);
    for _ in 0..(REST_S / task.step_s) as u64 {
        if world.outcome().asleep == centers.len() {
            break;
        }
        world.step(&wait);
    }
    let rested = world.state();
    let poses: Vec<Pose> = (0..centers.len()).map(|k| rested.object_pose(&model, k)).collect();
    for (body, pose) in bodies.iter_mut().zip(&poses) {
        body.position = pose.translation.to_array();
        body.quat_xyzw = pose.rotation.to_array();
    }
    let mut state = world.state().clone();
    state.step = 0;
    world.restore(state);
    let first_static = bodies.len();
    for (k, mut body) in furniture.into_iter().enumerate() {
        body.id = first_static + k;
        bodies.push(body);
    }
    let body_names = body_names(&model, hand.as_deref(), &bodies[first_static..]);
    let regions = task
        .boxes
        .iter()
        .map(|b| {
            let (min, max) = b.inner_volume();
            Region { name: b.name.clone(), min, max }
        })
        .collect();
    let scene = Scene { bodies, regions, gravity: config.gravity.to_array() };
    Ok(Built { world, scene, body_names })
}

fn add_furniture(task: &Task, model: &mut Model) -> Result<Vec<SceneBody>, palmares_sim::model::ModelError> {
    let mut bodies = Vec::new();
    let fixed = task
        .furniture
        .iter()
        .map(|f| (&f.name, f.friction, f.color, f.parts.clone()))
        .chain(task.boxes.iter().map(|b| (&b.name, b.friction, b.color, b.slabs())));
    for (name, friction, color, slabs) in fixed {
        let mut parts = Vec::new();
        for Slab { position, half_extents } in slabs {
            let (at, shape) = (Vec3::from_array(position), Shape::Box { half_extents, rounding: 0.0 });
            model.add_static(name, &shape, Pose::from_translation(at), friction)?;
            parts.push(part(at, shape));
        }
        bodies.push(SceneBody {
            id: 0,
            name: name.clone(),
            free: false,
            mass: 0.0,
            friction,
            position: [0.0; 3],
            quat_xyzw: [0.0, 0.0, 0.0, 1.0],
            parts,
            color,
        });
    }
    Ok(bodies)
}

fn part(at: Vec3, shape: Shape) -> ScenePart {
    ScenePart { position: at.to_array(), quat_xyzw: [0.0, 0.0, 0.0, 1.0], shape }
}

fn body_names(model: &Model, hand: Option<&Hand>, furniture: &[SceneBody]) -> Vec<String> {
    let mut fixed = furniture.iter().flat_map(|b| std::iter::repeat_n(&b.name, b.parts.len()));
    model
        .colliders()
        .iter()
        .map(|collider| match collider.owner {
            Owner::Link(i) => hand.map_or_else(String::new, |hand| hand.links[i].name.clone()),
            Owner::Object(k) => model.objects()[k].name.clone(),
            Owner::Static => fixed.next().cloned().unwrap_or_default(),
        })
        .collect()
}
