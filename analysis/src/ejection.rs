//! Which objects a closing hand holds and which it ejects, by simulation, over size and place.
//!
//! The hand closes without weight on an object that floats, so that only the hand decides. Then a load pulls on
//! the object in each of several directions. The outcome is what Birglen, Laliberté and Gosselin call grasp or ejection ("Underactuated
//! Robotic Hands", 2008, chapter 4), with friction and impacts.

use palmares_models::error::ModelError as ObjectError;
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::model::ModelError;
use palmares_sim::{BaseCommand, Command, Config, Model, Owner, State, World};
use std::sync::Arc;

/// The end of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// The hand touches it from the start, deeper than 1 mm.
    Overlaps,
    /// The hand closed without touching it in the end, and it is where it was.
    Missed,
    /// It left the hand while this closed, or moved on when the hand had closed.
    Ejected,
    /// It stayed while the hand closed, and left it under the load.
    Dropped,
    /// It stayed in the hand.
    Held,
    /// The simulation failed.
    Fault,
}

/// The object and the test of a place.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Mass of the object, kg.
    pub mass: f64,
    /// Its friction coefficient.
    pub friction: f64,
    /// Time in which the motors close, s.
    pub close_s: f64,
    /// Time after that until the load, and of each load, s.
    pub hold_s: f64,
    /// σ at the end, of every motor.
    pub sigma: Vec<f64>,
    /// Loads, N, in the world, one after the other.
    pub loads: Vec<Vec3>,
}

/// The outcome at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The end.
    pub fate: Fate,
    /// Distance of the object from its place at the end, m.
    pub moved: f64,
    /// Number of links that touch it at the end.
    pub links: usize,
}

/// An object or a world that cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum NoTrial {
    /// The object.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// The world.
    #[error(transparent)]
    World(#[from] ModelError),
}

/// An object that moves farther than this from its place has left, in units of its own size.
const LEFT: f64 = 3.0;
/// Speed of an object at rest, m/s: a held one has the hand's own.
const AT_REST: f64 = 0.02;
/// Deepest accepted overlap at the start, m.
const OVERLAP: f64 = 1e-3;

/// Plays one place. The base is at the world's origin.
///
/// # Errors
/// The object has no volume or mass.
pub fn play(
    config: &Config,
    hand: &Arc<Hand>,
    shape: &Shape,
    place: Pose,
    trial: &Trial,
) -> Result<Outcome, NoTrial> {
    let object =
        Object::new("object", vec![(Pose::IDENTITY, shape.clone())], trial.mass, trial.friction, 0.0)?;
    let config = Config { gravity: Vec3::ZERO, ..config.clone() };
    let mut model = Model::new(config, Some(Arc::clone(hand)))?;
    model.add_object(Arc::new(object))?;
    let model = Arc::new(model);
    let state = State::at_rest(&model, Pose::IDENTITY, &[place]);
    let start = state.objects[0].translation;
    let mut world = World::new(Arc::clone(&model), state);
    let mut command = Command::stay(&model, Pose::IDENTITY);
    command.base = BaseCommand::stay(Pose::IDENTITY);
    let size = shape.to_parry().map_or(0.0, |(solid, _)| solid.compute_local_bounding_sphere().radius);
    let step_s = model.config().step_s;
    let steps = |time: f64| (time / step_s).ceil() as usize;

    let ended = |world: &World, fate: Fate| Outcome {
        fate,
        moved: (world.state().objects[0].translation - start).length(),
        links: touching(world),
    };
    let left = |world: &World| (world.state().objects[0].translation - start).length() > LEFT * size;
    let closing = steps(trial.close_s);
    for step in 0..closing + steps(trial.hold_s) {
        let part = ((step + 1) as f64 / closing.max(1) as f64).min(1.0);
        command.sigma = trial.sigma.iter().map(|sigma| part * sigma).collect();
        let outcome = world.step(&command);
        if step == 0 && outcome.penetration_m > OVERLAP && touching(&world) > 0 {
            return Ok(ended(&world, Fate::Overlaps));
        }
        if world.fault().is_some() {
            return Ok(ended(&world, Fate::Fault));
        }
        if left(&world) {
            return Ok(ended(&world, Fate::Ejected));
        }
    }
    let at_end = ended(&world, Fate::Missed);
    if at_end.links == 0 && at_end.moved < 1e-9 {
        return Ok(at_end);
    }
    let v = &world.state().v[model.hand_dofs()..];
    let speed = Vec3::new(v[0], v[1], v[2]).length();
    if at_end.links == 0 || speed > AT_REST {
        return Ok(ended(&world, Fate::Ejected));
    }
    for load in &trial.loads {
        for _ in 0..steps(trial.hold_s) {
            world.push_object(0, *load, Vec3::ZERO);
            world.step(&command);
            if world.fault().is_some() {
                return Ok(ended(&world, Fate::Fault));
            }
            if left(&world) {
                return Ok(ended(&world, Fate::Dropped));
            }
        }
    }
    let fate = if touching(&world) == 0 { Fate::Dropped } else { Fate::Held };
    Ok(ended(&world, fate))
}

/// Number of links that touch the object.
fn touching(world: &World) -> usize {
    let mut links: Vec<usize> = world
        .contact_forces()
        .iter()
        .filter_map(|contact| match (contact.a, contact.b) {
            (Owner::Link(link), Owner::Object(_)) | (Owner::Object(_), Owner::Link(link)) => Some(link),
            _ => None,
        })
        .collect();
    links.sort_unstable();
    links.dedup();
    links.len()
}
