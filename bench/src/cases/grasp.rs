//! SoftHand grasps: close 0.5 s, lift 0.1 m in 1.5 s, hold 2 s, shake ±3 cm at 3 Hz for 2 s.

use super::case::{Case, Finding};
use super::grasp_scene::{GraspStart, Lie, before};
use super::setup::{Setup, moved, ramp, steps};
use crate::case_report::{Figure, Invariants};
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rigs::softhand;
use anyhow::{Context, Result};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::BaseCommand;
use palmares_sim::{Command, Config, Model, State, World};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "softhand_cylinder",
        "SoftHand closes on a 0.1 kg cylinder, lifts, holds and shakes it",
        cylinder,
    ),
    Case::new("softhand_box", "SoftHand closes on a 0.5 kg box, lifts, holds and shakes it", cuboid),
    Case::new(
        "softhand_cylinder_60s",
        "SoftHand holds the 0.1 kg cylinder still for 60 s: creep",
        |setup, recorder| long_hold(setup, recorder, &Grasp::cylinder()),
    ),
    Case::new(
        "softhand_box_60s",
        "SoftHand holds the 0.5 kg box still for 60 s: creep",
        |setup, recorder| long_hold(setup, recorder, &Grasp::cuboid()),
    ),
];

/// Friction coefficient of the hand's surfaces and of the object in these cases, for any hand.
const GLOVE: f64 = 1.0;

/// Friction coefficient of object and pedestal.
const ON_PEDESTAL: f64 = 0.5;

/// Gap between hand and object, m.
const GAP_M: f64 = 1e-3;

/// Position of the object in the hand's frame before closing, on the palm's normal (+x) and across the
/// fingers, and set point of the motor.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Along the fingers from the wrist flange, m.
    pub along_m: f64,
    /// Across them, m.
    pub across_m: f64,
    /// Set point of the motor.
    pub sigma: f64,
}

/// The placement of the cases, from a search around those of [`crate::robust::placements`] that keep both
/// objects at every step. In it the fingers touch nearly the same places at every step; in others a finger
/// ends up on another edge at some step, and the overlap there is half or twice as deep.
pub const CHOSEN: Placement = Placement { along_m: 0.148, across_m: -0.01, sigma: 0.9 };

/// Until when the object is held still and when the run ends, s.
#[derive(Clone, Copy, Debug)]
struct Schedule {
    hold_s: f64,
    end_s: f64,
}

const SHAKEN: Schedule = Schedule { hold_s: 4.0, end_s: 6.0 };
/// Without the shaking.
const UNTIL_HELD: Schedule = Schedule { end_s: SHAKEN.hold_s, ..SHAKEN };
/// The hold settles for half a second after the lift; creep is measured over the 60 s that follow.
const LONG: Schedule = Schedule { hold_s: 62.5, end_s: 62.5 };

/// An object of the grasp cases, in the hand's frame.
#[derive(Clone, Debug)]
pub struct Grasp {
    /// Its shape.
    pub shape: Shape,
    /// kg
    pub mass: f64,
    /// Turns the shape into the grasp.
    pub hand_from_object: Rotation,
}

impl Grasp {
    /// A cylinder of r = 4 cm, h = 7 cm and 0.1 kg, its axis along the knuckles.
    pub fn cylinder() -> Self {
        let shape = Shape::Cylinder { radius: 0.04, half_length: 0.035 };
        Grasp { shape, mass: 0.1, hand_from_object: Rotation::from_rotation_x(FRAC_PI_2) }
    }

    /// A box of 6 x 12 x 6 cm and 0.5 kg, its long side along the knuckles.
    pub fn cuboid() -> Self {
        let shape = Shape::Box { half_extents: [0.03, 0.06, 0.03], rounding: 0.0 };
        Grasp { shape, mass: 0.5, hand_from_object: Rotation::IDENTITY }
    }

    /// A capsule of r = 4 cm, 14 cm long and 0.3 kg, its axis along the knuckles.
    pub fn capsule() -> Self {
        let shape = Shape::Capsule { radius: 0.04, half_length: 0.03 };
        Grasp { shape, mass: 0.3, hand_from_object: Rotation::from_rotation_x(FRAC_PI_2) }
    }
}

/// The cylinder, closed on, lifted, held and shaken.
pub fn cylinder(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    case(setup, recorder, &Grasp::cylinder())
}

/// The box, closed on, lifted, held and shaken.
pub fn cuboid(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    case(setup, recorder, &Grasp::cuboid())
}

/// Whether a grasp in a placement is kept through lift, hold and shaking, with every step converged.
pub fn kept(setup: &Setup, grasp: &Grasp, placement: Placement) -> Result<bool> {
    let invariants = play(setup, grasp, placement, SHAKEN, &mut Recorder::default())?.invariants;
    Ok(invariants.held == Some(true) && invariants.newton_unconverged == Some(0))
}

/// Speed at which the object creeps in the hand over 60 s of holding still.
fn long_hold(setup: &Setup, recorder: &mut Recorder, grasp: &Grasp) -> Result<Finding> {
    let run = play(setup, grasp, CHOSEN, LONG, recorder)?;
    let creep = run.invariants.slip_mm_s.context("a hold reports its slip")?;
    Ok(Finding { error: Figure::new("creep over 60 s", creep, "mm/s"), invariants: run.invariants })
}

fn case(setup: &Setup, recorder: &mut Recorder, grasp: &Grasp) -> Result<Finding> {
    let run = play(setup, grasp, CHOSEN, SHAKEN, recorder)?;
    // A lost object's error is not worth a long reference run.
    let error = setup.reference().filter(|_| run.invariants.held == Some(true)).and_then(|fine| {
        let name = format!("grasp of {:?}, {} kg", grasp.shape, grasp.mass);
        let reference = fine
            .once(&name, |fine| Ok(play(fine, grasp, CHOSEN, UNTIL_HELD, &mut Recorder::default())?.trace));
        // A run can succeed although its fine run does not finish.
        reference.ok().map(|reference| largest_distance(&run.trace, &reference) * 1e3)
    });
    Ok(Finding {
        error: Figure::from_own_fine_run("largest distance of the object from its own fine run", error, "mm"),
        invariants: run.invariants,
    })
}

/// Largest distance of the object's centre in the palm between two runs until the end of the hold, m. The
/// first run is recorded.
pub fn difference(a: &Setup, b: &Setup, grasp: &Grasp, recorder: &mut Recorder) -> Result<f64> {
    let first = play(a, grasp, CHOSEN, UNTIL_HELD, recorder)?;
    let second = play(b, grasp, CHOSEN, UNTIL_HELD, &mut Recorder::default())?;
    Ok(largest_distance(&first.trace, &second.trace))
}

fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max)
}

/// A finished run.
struct Run {
    /// Centre of the object in the palm's frame every 16 ms until the end of the hold, m.
    trace: Vec<Vec3>,
    invariants: Invariants,
}

fn play(
    setup: &Setup,
    grasp: &Grasp,
    placement: Placement,
    schedule: Schedule,
    recorder: &mut Recorder,
) -> Result<Run> {
    let dt_s = setup.dt_s;
    let (model, state, start) = scene(&softhand()?, Config::with_step(dt_s), grasp, placement)?;
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), start);
    let in_palm = |world: &dyn Engine| {
        let base = world.state().base;
        base.inverse_transform_point(world.state().objects[0].translation)
    };
    let every = steps(16e-3, dt_s).max(1);
    let (mut trace, mut tension) = (Vec::new(), Vec::new());
    let (mut settled, mut held) = (Vec3::ZERO, Vec3::ZERO);
    let floor = world.state().objects[0].translation.z;
    let (mut residual, mut balance, mut depth) = (None, None, 0.0);
    for k in 0..steps(schedule.end_s, dt_s) {
        let t = (k + 1) as f64 * dt_s;
        command.sigma[0] = placement.sigma * ramp(t / 0.5).0;
        command.base = path(start, t, schedule.hold_s);
        recorder.step(&mut *world, &command)?;
        // In the first step that ends at or after a time; steps need not divide it.
        let reached = |time: f64| t >= time - 1e-9 && t - dt_s < time - 1e-9;
        if (k + 1) % every == 0 && t <= schedule.hold_s + 0.5 * dt_s {
            trace.push(in_palm(&*world));
        }
        if reached(2.5) {
            settled = in_palm(&*world);
        }
        if t > 2.5 && t <= schedule.hold_s {
            tension.push(world.state().tension[0]);
        }
        if reached(schedule.hold_s) {
            held = in_palm(&*world);
            residual = world.world().map(static_residual);
            balance = world.world().map(tension_balance);
            depth = world.outcome().penetration_m;
        }
    }
    let mean = tension.iter().sum::<f64>() / tension.len().max(1) as f64;
    let variance = tension.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / tension.len().max(1) as f64;
    let lifted = world.state().objects[0].translation.z > floor + 0.05;
    let invariants = Invariants {
        held: Some(lifted && (in_palm(&*world) - settled).length() < 0.03),
        slip_mm_s: Some((held - settled).length() * 1e3 / (schedule.hold_s - 2.5)),
        tension_chatter: Some(variance.sqrt()),
        static_residual_nm: residual,
        tension_balance_nm: balance,
        hold_penetration_mm: Some(depth * 1e3),
        ..recorder.invariants()
    };
    Ok(Run { trace, invariants })
}

/// Lift along z from 0.5 s to 2 s, shake along y from the end of the hold on with an onset of 0.1 s.
fn path(start: Pose, t: f64, hold_s: f64) -> BaseCommand {
    let (rise, rate) = ramp((t - 0.5) / 1.5);
    let mut offset = Vec3::new(0.0, 0.0, 0.1 * rise);
    let mut linear = Vec3::new(0.0, 0.0, 0.1 * rate / 1.5);
    if t > hold_s {
        let (amplitude, omega) = (0.03, 6.0 * PI);
        let (onset, setting_in) = ramp((t - hold_s) / 0.1);
        let phase = omega * (t - hold_s);
        offset.y += amplitude * onset * phase.sin();
        linear.y += amplitude * (onset * omega * phase.cos() + setting_in / 0.1 * phase.sin());
    }
    moved(start, offset, linear)
}

/// The hand palm down over the object, on a pedestal 1 mm before the palm.
///
/// # Errors
/// A shape without volume.
pub fn scene(
    hand: &Arc<Hand>,
    config: Config,
    grasp: &Grasp,
    placement: Placement,
) -> Result<(Model, State, Pose)> {
    let mut hand = Hand::clone(hand);
    hand.links.iter_mut().flat_map(|link| &mut link.geoms).for_each(|geom| geom.friction = GLOVE);
    let parts = vec![(Pose::IDENTITY, grasp.shape.clone())];
    let object = Object::new("object", parts, grasp.mass, GLOVE, 0.0)?;
    let lie = Lie {
        object: Arc::new(object),
        hand_from_grip: Rotation::IDENTITY,
        grip_from_object: grasp.hand_from_object,
        along_m: placement.along_m,
        across_m: placement.across_m,
        gap_m: GAP_M,
        // Friction of a pair is the geometric mean.
        pedestal_friction: ON_PEDESTAL.powi(2) / GLOVE,
    };
    let GraspStart { model, state, start } = before(&Arc::new(hand), config, &lie)?;
    Ok((model, state, start))
}

/// Largest unbalanced torque on a joint, `|Rᵀ f − E (q − q₀) + Jᵀ f_c + limits|`: the static balance of
/// adaptive synergies, with the forces of the last step. N·m
pub fn static_residual(world: &World) -> f64 {
    world.joint_residual().iter().fold(0.0, |most, tau| tau.abs().max(most))
}

/// Largest difference of a tension from its cable's law at the present configuration, `tension_balance_nm`.
pub fn tension_balance(world: &World) -> f64 {
    let Some(hand) = world.model().hand() else { return 0.0 };
    let state = world.state();
    let mut worst: f64 = 0.0;
    for (tendon, f) in hand.tendons.iter().zip(&state.tension) {
        let motor = tendon.wound(&hand.motors, |motor| state.motors[motor].position);
        let mut rate = 0.0;
        tendon.gradient(&state.q, |c, r| rate += r * state.v[6 + c]);
        let law = tendon.stiffness * (motor - tendon.length(&state.q)) - tendon.damping * rate;
        worst = worst.max((f - law.clamp(tendon.least_force(), tendon.most_held())).abs());
    }
    worst
}

/// The cylinder grasp after `time_s` of its path, and the command that keeps closing there.
#[cfg(test)]
pub(crate) fn closing(time_s: f64) -> (World, Command) {
    let dt_s = 1e-3;
    let (model, state, start) =
        scene(&softhand().expect("it is built in"), Config::with_step(dt_s), &Grasp::cylinder(), CHOSEN)
            .expect("the scene is sound");
    let mut world = World::new(Arc::new(model), state);
    let mut command = Command::stay(world.model(), start);
    for k in 0..steps(time_s, dt_s) {
        let t = (k + 1) as f64 * dt_s;
        command.sigma[0] = CHOSEN.sigma * ramp(t / 0.5).0;
        command.base = path(start, t, SHAKEN.hold_s);
        world.step(&command);
    }
    (world, command)
}

/// The cylinder held still in the air.
#[cfg(test)]
pub(crate) fn held_still() -> (World, Command) {
    closing(3.5)
}
