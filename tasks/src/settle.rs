//! The scene without a hand: from a task and a seed to a world at rest.

use crate::overlap::Overlap;
use crate::place::{Placed, SceneRng, place};
use crate::scene::{Region, Scene, SceneBody, ScenePart};
use crate::seed::Seed;
use crate::task::{Ground, Slab, Task};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::model::ModelError;
use palmares_sim::{Command, Config, Model, Owner, State, World};
use std::sync::Arc;

/// Longest time the world is given to come to rest after placing, s.
const REST_S: f64 = 3.0;
/// An object with a pose of its own has stayed there if its centre of mass has not moved this far, m.
const STAYED_M: f64 = 0.02;
/// Placements tried before a scene is given up.
const DRAWS: usize = 20;

/// The most that coming to rest may compute over all placements, in the unit of [`palmares_sim::bounds`]: some seconds.
pub const SCENE_WORK: u64 = 2_000_000_000;

/// Error of a scene that cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The task has no sound scene, or the hand no sound state.
    #[error("task `{task}`: {message}")]
    Unsound {
        /// Name of the task.
        task: String,
        /// The problem.
        message: String,
    },
    /// The hand does not fit where it starts: its parts touch what is there, or reach into a region of the rules.
    #[error("task `{task}`: where it starts, {}", first_of(overlaps))]
    HandInTheWay {
        /// Name of the task.
        task: String,
        /// The overlaps; never empty.
        overlaps: Vec<Overlap>,
    },
}

impl SceneError {
    pub(crate) fn unsound(task: &Task, message: impl ToString) -> Self {
        SceneError::Unsound { task: task.name.clone(), message: message.to_string() }
    }
}

/// The first of many overlaps in words, and how many more there are.
fn first_of(overlaps: &[Overlap]) -> String {
    match overlaps {
        [] => "nothing overlaps".to_owned(),
        [only] => only.to_string(),
        [first, rest @ ..] => format!("{first}, and {} more", rest.len()),
    }
}

/// A world at tick 0 and its description for clients.
pub struct Built {
    /// The world, its objects at rest.
    pub world: World,
    /// The description of the world.
    pub scene: Scene,
    /// Name of the body of every collider, in the model's order.
    pub body_names: Vec<String>,
}

/// Furniture, containers and placed objects at rest. A placement in which something does not come to rest where it
/// should is drawn again, so that every seed has a sound scene.
pub(crate) fn draw(task: &Task, seed: Seed) -> Result<Built, SceneError> {
    let mut dice = SceneRng::new(seed);
    let mut last = String::new();
    let mut work = 0;
    for _ in 0..DRAWS {
        let placed = match place(task, &mut dice) {
            Ok(placed) => placed,
            Err(why) => {
                last = why;
                continue;
            }
        };
        let built = assemble(task, &placed, &mut work).map_err(|e| SceneError::unsound(task, e))?;
        if work > SCENE_WORK {
            let message = "the scene needs more computing to come to rest than it may";
            return Err(SceneError::unsound(task, message));
        }
        match unsound(task, &placed, &built) {
            None => return Ok(built),
            Some(why) => last = why,
        }
    }
    Err(SceneError::unsound(task, format!("no sound scene in {DRAWS} draws; the last: {last}")))
}

/// Furniture and containers without objects.
pub(crate) fn furnished(task: &Task) -> Result<Built, SceneError> {
    assemble(task, &[], &mut 0).map_err(|e| SceneError::unsound(task, e))
}

/// Checks a settled scene.
fn unsound(task: &Task, placed: &[Placed], built: &Built) -> Option<String> {
    let (state, model) = (built.world.state(), built.world.model());
    let region = task.place.into_region().and_then(|name| task.region(name));
    for (k, (object, placed)) in model.objects().iter().zip(placed).enumerate() {
        let at = state.objects[k].translation;
        let stayed = match region {
            Some((low, high)) => (0..3).all(|axis| at[axis] > low[axis] && at[axis] < high[axis]),
            None => (at - placed.pose * object.com).length() < STAYED_M,
        };
        if !stayed {
            let moved_mm = 1e3 * (at - placed.pose * object.com).length();
            return Some(format!(
                "{} did not stay where it was put: it moved by {moved_mm:.0} mm; it needs something to lie on, and room",
                object.name
            ));
        }
        if !state.sleep[k].asleep {
            let spin = state.v[model.object_dofs(k) + 5].abs();
            let why = if object.torsional_friction == 0.0 && spin > model.config().sleep_angular {
                format!("; it spins at {spin:.2} rad/s, which `torsional_friction` brakes")
            } else {
                String::new()
            };
            return Some(format!("{} does not come to rest{why}", object.name));
        }
    }
    None
}

/// A world of placed objects, settled.
fn assemble(task: &Task, placed: &[Placed], work: &mut u64) -> Result<Built, ModelError> {
    let config = Config::with_step(task.step_s);
    let mut model = Model::new(config.clone(), None)?;
    let furniture = add_furniture(task, &mut model)?;
    let mut bodies = Vec::new();
    for (k, Placed { object, color, .. }) in placed.iter().enumerate() {
        model.add_object(Arc::clone(object))?;
        bodies.push(SceneBody {
            id: k,
            name: object.name.clone(),
            free: true,
            endless: false,
            mass: object.mass,
            com: object.com.to_array(),
            friction: object.friction,
            position: Some([0.0; 3]),
            quat_xyzw: Some([0.0, 0.0, 0.0, 1.0]),
            parts: object.parts.iter().map(|(pose, shape)| part(*pose, shape.clone())).collect(),
            color: *color,
        });
    }
    let model = Arc::new(model);
    let poses: Vec<Pose> = placed.iter().map(|placed| placed.pose).collect();
    let mut world = World::new(Arc::clone(&model), State::at_rest(&model, Pose::IDENTITY, &poses));
    // Objects were placed without this world's contact law, and must settle in it.
    let wait = Command::stay(&model, Pose::IDENTITY);
    for _ in 0..(REST_S / task.step_s) as u64 {
        if world.outcome().asleep == placed.len() || world.fault().is_some() || *work > SCENE_WORK {
            break;
        }
        *work += world.step(&wait).work;
    }
    for (k, body) in bodies.iter_mut().enumerate() {
        let pose = world.state().object_pose(&model, k);
        body.position = Some(pose.translation.to_array());
        body.quat_xyzw = Some(pose.rotation.to_array());
    }
    if world.fault().is_none() {
        let mut state = world.state().clone();
        state.step = 0;
        world.restore(state);
    }
    let first_static = bodies.len();
    for (k, mut body) in furniture.into_iter().enumerate() {
        body.id = first_static + k;
        bodies.push(body);
    }
    let body_names = body_names(&model, &bodies[first_static..]);
    let regions = task
        .regions()
        .map(|(name, (min, max))| {
            let role = task.rules.role(name).map(str::to_owned);
            Region { name: name.to_owned(), role, min, max }
        })
        .collect();
    let scene = Scene { bodies, regions, gravity: config.gravity.to_array(), goals: task.rules.goals() };
    Ok(Built { world, scene, body_names })
}

fn add_furniture(task: &Task, model: &mut Model) -> Result<Vec<SceneBody>, ModelError> {
    let (ground, Slab { position, half_extents }) = (&task.ground, task.ground.slab());
    model.add_ground(ground.height, ground.friction);
    let at = Pose::from_translation(Vec3::from_array(position));
    let drawn = part(at, Shape::Box { half_extents, rounding: 0.0 });
    let endless = fixed_body(Ground::NAME, ground.friction, ground.color, vec![drawn]);
    let mut bodies = vec![SceneBody { endless: true, ..endless }];
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
            parts.push(part(Pose::from_translation(at), shape));
        }
        bodies.push(fixed_body(name, friction, color, parts));
    }
    Ok(bodies)
}

fn fixed_body(name: &str, friction: f64, color: [f64; 3], parts: Vec<ScenePart>) -> SceneBody {
    SceneBody {
        id: 0,
        name: name.to_owned(),
        free: false,
        endless: false,
        mass: 0.0,
        com: [0.0; 3],
        friction,
        position: Some([0.0; 3]),
        quat_xyzw: Some([0.0, 0.0, 0.0, 1.0]),
        parts,
        color,
    }
}

fn part(at: Pose, shape: Shape) -> ScenePart {
    ScenePart { position: at.translation.to_array(), quat_xyzw: at.rotation.to_array(), shape }
}

fn body_names(model: &Model, furniture: &[SceneBody]) -> Vec<String> {
    let mut fixed = furniture.iter().flat_map(|b| std::iter::repeat_n(&b.name, b.parts.len()));
    let colliders = model.colliders().iter();
    colliders
        .map(|collider| match collider.owner {
            Owner::Object(k) => model.objects()[k].name.clone(),
            Owner::Static | Owner::Link(_) => fixed.next().cloned().unwrap_or_default(),
        })
        .collect()
}
