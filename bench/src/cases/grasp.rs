//! SoftHand grasps: close 0.5 s, lift 0.1 m in 1.5 s, hold 2 s, shake ±2 cm at 3 Hz for 2 s.

use super::synergy::softhand;
use super::{Case, Finding, Setup, ramp, steps};
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::report::{Figure, Invariants};
use anyhow::{Context, Result};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::actuation::base::BaseCommand;
use palmares_sim::state::BaseReference;
use palmares_sim::{Command, Config, Model, Owner, State, World};
use parry3d_f64::query;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case {
        name: "softhand_cylinder",
        about: "SoftHand closes on a 0.1 kg cylinder, lifts, holds and shakes it",
        peers: true,
        run: cylinder,
    },
    Case {
        name: "softhand_box",
        about: "SoftHand closes on a 0.5 kg box, lifts, holds and shakes it",
        peers: true,
        run: cuboid,
    },
];

/// Where the object lies in the hand's frame before closing: on the palm's normal (+x), across the fingers.
const ALONG_FINGERS_M: f64 = 0.16;
const ACROSS_FINGERS_M: f64 = -0.015;

/// Where the motor goes. Place and σ were chosen among 54 combinations as one that keeps both objects at every
/// step; most others lose one of them while it is shaken.
const CLOSED_SIGMA: f64 = 0.7;

/// An object of the grasp cases, in the hand's frame.
struct Grasp {
    shape: Shape,
    mass: f64,
    /// Turns the shape so that it lies well in the hand.
    hand_from_object: Rotation,
}

/// A cylinder of r = 4 cm, h = 7 cm and 0.1 kg, its axis along the knuckles.
pub fn cylinder(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let lying = Rotation::from_rotation_x(FRAC_PI_2);
    let shape = Shape::Cylinder { radius: 0.04, half_length: 0.035 };
    case(setup, recorder, &Grasp { shape, mass: 0.1, hand_from_object: lying })
}

/// A box of 6 x 12 x 6 cm and 0.5 kg, its long side along the knuckles.
pub fn cuboid(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let shape = Shape::Box { half_extents: [0.03, 0.06, 0.03], rounding: 0.0 };
    case(setup, recorder, &Grasp { shape, mass: 0.5, hand_from_object: Rotation::IDENTITY })
}

fn case(setup: &Setup, recorder: &mut Recorder, grasp: &Grasp) -> Result<Finding> {
    let run = play(setup, grasp, recorder)?;
    let error = match setup.reference() {
        None => None,
        Some(fine) => {
            eprintln!("reference run at {} ms ...", fine.dt_s * 1e3);
            let reference = play(&fine, grasp, &mut Recorder::default())?;
            let worst = run
                .trace
                .iter()
                .zip(&reference.trace)
                .map(|(a, b)| (*a - *b).length() * 1e3)
                .fold(0.0, f64::max);
            Some(worst)
        }
    };
    Ok(Finding {
        error: Figure {
            name: "largest object error until the end of the hold".into(),
            value: error,
            unit: "mm".into(),
        },
        invariants: run.invariants,
    })
}

/// A finished run.
struct Run {
    /// Centre of the object in the palm's frame every 8 ms until the end of the hold, m.
    trace: Vec<Vec3>,
    invariants: Invariants,
}

fn play(setup: &Setup, grasp: &Grasp, recorder: &mut Recorder) -> Result<Run> {
    let dt_s = setup.dt_s;
    let (model, state, start) = scene(dt_s, grasp)?;
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), start);
    let in_palm = |world: &dyn Engine| {
        let base = world.state().base;
        base.inverse_transform_point(world.state().objects[0].translation)
    };
    let every = steps(8e-3, dt_s).max(1);
    let (mut trace, mut tension) = (Vec::new(), Vec::new());
    let (mut settled, mut held) = (Vec3::ZERO, Vec3::ZERO);
    let floor = world.state().objects[0].translation.z;
    let mut residual = None;
    for k in 0..steps(6.0, dt_s) {
        let t = (k + 1) as f64 * dt_s;
        command.sigma[0] = CLOSED_SIGMA * ramp(t / 0.5).0;
        command.base = BaseCommand::Exact(path(start, t));
        recorder.step(&mut *world, &command)?;
        // In the first step that ends at or after a time; steps need not divide it.
        let reached = |time: f64| t >= time - 1e-9 && t - dt_s < time - 1e-9;
        if (k + 1) % every == 0 && t <= 4.0 + 0.5 * dt_s {
            trace.push(in_palm(&*world));
        }
        if reached(2.5) {
            settled = in_palm(&*world);
        }
        if t > 2.5 && t <= 4.0 {
            tension.push(world.state().tension[0]);
        }
        if reached(4.0) {
            held = in_palm(&*world);
            residual = world.world().map(static_residual);
        }
    }
    let mean = tension.iter().sum::<f64>() / tension.len().max(1) as f64;
    let variance = tension.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / tension.len().max(1) as f64;
    let lifted = world.state().objects[0].translation.z > floor + 0.05;
    let invariants = Invariants {
        held: Some(lifted && (in_palm(&*world) - settled).length() < 0.03),
        slip_mm_s: Some((held - settled).length() * 1e3 / 1.5),
        tension_chatter: Some(variance.sqrt()),
        static_residual_nm: residual,
        ..recorder.invariants()
    };
    Ok(Run { trace, invariants })
}

/// Lift along z from 0.5 s to 2 s, shake along y from 4 s on with an onset of 0.1 s.
fn path(start: Pose, t: f64) -> BaseReference {
    let (rise, rate) = ramp((t - 0.5) / 1.5);
    let mut offset = Vec3::new(0.0, 0.0, 0.1 * rise);
    let mut linear = Vec3::new(0.0, 0.0, 0.1 * rate / 1.5);
    if t > 4.0 {
        let (omega, onset) = (6.0 * PI, ((t - 4.0) / 0.1).min(1.0));
        let phase = omega * (t - 4.0);
        offset.y += 0.02 * onset * phase.sin();
        linear.y += 0.02 * onset * omega * phase.cos();
    }
    BaseReference {
        pose: Pose::from_parts(start.translation + offset, start.rotation),
        linear,
        angular: Vec3::ZERO,
    }
}

/// The hand palm down over the object, which stands on a pedestal 1 mm before the palm.
fn scene(dt_s: f64, grasp: &Grasp) -> Result<(Model, State, Pose)> {
    let hand = softhand()?;
    let mut model = Model::new(Config::with_step(dt_s), Some(Arc::clone(&hand)))?;
    let parts = vec![(Pose::IDENTITY, grasp.shape.clone())];
    let object = Object::new("object", parts, grasp.mass, 0.8, 0.0)?;
    let (shape, upright) = grasp.shape.to_parry().context("the grasp shapes are solid")?;
    let shape_at = |x: f64| {
        let at = Vec3::new(x, ACROSS_FINGERS_M, ALONG_FINGERS_M);
        Pose::from_parts(at, grasp.hand_from_object) * upright
    };
    let links = hand.base_from_links(&vec![0.0; hand.coordinates.len()]);
    let clearance = |x: f64| {
        let mut least = f64::INFINITY;
        for collider in model.colliders() {
            if let Owner::Link(i) = collider.owner {
                let pose = links[i] * collider.body_from_shape;
                let gap = query::distance(&pose, &*collider.shape, &shape_at(x), &*shape);
                least = least.min(gap.map_or(f64::INFINITY, |gap| gap.distance));
            }
        }
        least
    };
    let mut x = 0.0;
    while clearance(x) < 1e-3 {
        x += 5e-4;
    }
    let center = Vec3::new(x, ACROSS_FINGERS_M, ALONG_FINGERS_M);
    // Palm normal +x down.
    let down = Rotation::from_rotation_y(FRAC_PI_2);
    let base = Pose::from_parts(-(down * center), down);
    let object_pose = Pose::from_parts(Vec3::ZERO, down * grasp.hand_from_object);
    let low = shape.compute_aabb(&(object_pose * upright)).mins.z;
    let pedestal = Shape::Box { half_extents: [0.02, 0.02, 0.02], rounding: 0.0 };
    model.add_static("pedestal", &pedestal, Pose::translation(0.0, 0.0, low - 0.02 - 1e-5), 0.5)?;
    model.add_object(Arc::new(object))?;
    let state = State::at_rest(&model, base, &[object_pose]);
    Ok((model, state, base))
}

/// Largest unbalanced torque on a joint, `|Rᵀ f − E (q − q₀) + Jᵀ f_c + limits|`: the static balance of
/// adaptive synergies, with the forces of the last step. N·m
pub fn static_residual(world: &World) -> f64 {
    world.joint_residual().iter().fold(0.0, |most, tau| tau.abs().max(most))
}

/// The cylinder grasp after `time_s` of its path, and the command that keeps closing there.
#[cfg(test)]
pub(crate) fn closing(time_s: f64) -> (World, Command) {
    let lying = Rotation::from_rotation_x(FRAC_PI_2);
    let shape = Shape::Cylinder { radius: 0.04, half_length: 0.035 };
    let grasp = Grasp { shape, mass: 0.1, hand_from_object: lying };
    let dt_s = 1e-3;
    let (model, state, start) = scene(dt_s, &grasp).expect("the scene is sound");
    let mut world = World::new(Arc::new(model), state);
    let mut command = Command::stay(world.model(), start);
    for k in 0..steps(time_s, dt_s) {
        let t = (k + 1) as f64 * dt_s;
        command.sigma[0] = CLOSED_SIGMA * ramp(t / 0.5).0;
        command.base = BaseCommand::Exact(path(start, t));
        world.step(&command);
    }
    (world, command)
}

/// The cylinder held still in the air.
#[cfg(test)]
pub(crate) fn held_still() -> (World, Command) {
    closing(3.5)
}
