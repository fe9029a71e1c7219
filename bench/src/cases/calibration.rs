//! Measurements on the real SoftHand, repeated: Catalano, Grioli, Farnioli, Serio, Piazza, Bicchi, *Adaptive synergies for
//! the design and control of the Pisa/IIT SoftHand*, IJRR 33(5), 2014, section V-A and figures 18 and 19.
//!
//! The hand wore a glove with padded rubber surfaces. The grasp force was read from a split cylinder, 120 mm high and
//! 45 mm thick, with a six-axis sensor (ATI Nano17) between its halves; the holding torque from a disc, 20 mm high and
//! 95 mm wide. The largest readings were about 20 N along the sensor's z axis and 2 N·m; 28 N and 3.5 N·m with a stronger
//! motor. The paper does not say where the objects lay in the hand, how the split stood to it, or how often it was done.
//!
//! Here the wrist is fixed, as in the paper's first condition; a person lays the object into the hand, which closes on a
//! full command with its motor on. Gravity is off: the object's weight is not published, and a sensor is zeroed with it.

use super::case::{Case, Finding};
use super::grasp_scene::{Lie, Scene, floating};
use super::setup::{Setup, ends_of_steps, ramp, steps};
use crate::case_report::Figure;
use crate::energy::Ledger;
use crate::engine::Engine;
use crate::measured::Measured;
use crate::recorder::Recorder;
use crate::rigs::{bolted, softhand};
use anyhow::{Context, Result};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3, rotation};
use palmares_sim::{Command, Config, Model, Owner, State, World};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "softhand_split_cylinder",
        "SoftHand closes on a split cylinder: force between its halves; the real hand's: 20 N",
        split_cylinder,
    ),
    Case::ours(
        "softhand_disc_torque",
        "SoftHand closes on a disc that is then turned: the torque that it holds; the real hand's: 2 N·m",
        disc_torque,
    ),
    Case::ours(
        "softhand_closing",
        "SoftHand closes in air: time to 95 % and to the fist, mean and largest power of its motor, of 6 W",
        closing,
    ),
];

/// The command reaches its end after this time, s, and the reading begins and ends.
const CLOSED_S: f64 = 1.5;
const READ_S: f64 = 2.8;
const READ_END_S: f64 = 3.0;
/// The person's grasp of the object until the hand has closed: as a spring and a damper about the place, N/m and N·m/rad,
/// with at most this force, N, and torque, N·m. It lets go over half a second before the reading. Guesses: without it the
/// first finger pushes the object out of the hand.
const PERSON: f64 = 500.0;
const PERSON_TURN: f64 = 1.0;
const PERSON_MOST: (f64, f64) = (20.0, 1.0);
const LETS_GO_S: (f64, f64) = (1.6, 2.1);
/// Friction of the objects, that of the grasp cases: with the glove's 1.16 a pair has 0.96. Materials are not published;
/// rubber on dry plastics and metals has 0.5 to 1.
const FRICTION: f64 = 0.8;
/// Mass of the objects, kg; it only sets how fast they follow the fingers.
const MASS: f64 = 0.1;
/// The object is lost when its centre has moved by this in the hand, m, or when less than this force holds it, N.
const LOST_M: f64 = 0.06;
const LOST_N: f64 = 0.1;
/// Planes through the cylinder's axis over which the force is averaged.
const PLANES: usize = 36;
/// The disc's torque grows by this, N·m/s, until it has turned by the angle, rad, or to the most that is tried, N·m.
const TORQUE_RATE: f64 = 1.0;
const TURNED: f64 = PI / 6.0;
const MOST_TORQUE: f64 = 30.0;

/// Where a person lays the object: its centre from that of the palm, along the fingers and across them, mm; turned about
/// the palm's normal and about the fingers' direction, degrees.
type Place = (&'static str, f64, f64, f64, f64);

/// The centre of the palm: along the fingers from the wrist flange and across them, m.
const PALM: (f64, f64) = (0.148, -0.01);

/// The cylinder across the palm, at the roots of the fingers.
const ON_CYLINDER: &[Place] = &[
    ("in the middle", 0.0, 0.0, 0.0, 0.0),
    ("8 mm to the wrist", -8.0, 0.0, 0.0, 0.0),
    ("8 mm to the fingertips", 8.0, 0.0, 0.0, 0.0),
    ("10 mm to the thumb", 0.0, 10.0, 0.0, 0.0),
    ("10 mm to the little finger", 0.0, -10.0, 0.0, 0.0),
    ("turned by 10 degrees", 0.0, 0.0, 10.0, 0.0),
    ("turned by -10 degrees", 0.0, 0.0, -10.0, 0.0),
    ("tilted by 5 degrees", 0.0, 0.0, 0.0, 5.0),
    ("tilted by -5 degrees", 0.0, 0.0, 0.0, -5.0),
];

/// The disc flat in the palm, like a lid.
const ON_DISC: &[Place] = ON_CYLINDER;

/// A grasp that has closed.
struct Held {
    world: Box<dyn Engine>,
    command: Command,
    /// The object's pose before.
    placed: Pose,
}

fn own(world: &dyn Engine) -> Result<&World> {
    world.world().context("only our own engine tells its forces")
}

/// Force of the hand on the object at every touching point.
fn forces(world: &World) -> Vec<(Vec3, Vec3)> {
    let on_object = |c: &palmares_sim::ContactForce| match (c.a, c.b) {
        (Owner::Object(0), _) => Some((c.position, -c.force)),
        (_, Owner::Object(0)) => Some((c.position, c.force)),
        _ => None,
    };
    world.contact_forces().iter().filter_map(on_object).collect()
}

/// The force that a sensor between the halves of a body reads, pressed together positive: the plane through `centre` with
/// this normal splits it, and each half passes on what presses on it. Half the sum, as both halves are at rest.
pub fn between_halves(forces: &[(Vec3, Vec3)], centre: Vec3, normal: Vec3) -> f64 {
    let on = |(at, force): &(Vec3, Vec3)| {
        let along = force.dot(normal);
        if (*at - centre).dot(normal) > 0.0 { -along } else { along }
    };
    0.5 * forces.iter().map(on).sum::<f64>()
}

impl Held {
    fn close(
        setup: &Setup,
        recorder: &mut Recorder,
        hand: &Arc<Hand>,
        (shape, upright): (&Shape, Rotation),
        &(_, along_mm, across_mm, turn_deg, tilt_deg): &Place,
    ) -> Result<Held> {
        let turn = rotation::from_rpy([turn_deg.to_radians(), 0.0, tilt_deg.to_radians()]);
        let object = Object::new("object", vec![(Pose::IDENTITY, shape.clone())], MASS, FRICTION, 0.0)?;
        let lie = Lie {
            object: Arc::new(object),
            hand_from_grip: Rotation::IDENTITY,
            grip_from_object: turn * upright,
            along_m: PALM.0 + 1e-3 * along_mm,
            across_m: PALM.1 + 1e-3 * across_mm,
            gap_m: 1e-3,
            pedestal_friction: 0.0,
        };
        let Scene { model, state, start } = floating(hand, weightless(setup.dt_s), &lie)?;
        let world = setup.start(model, state)?;
        let command = Command::stay(world.model(), start);
        let placed = world.state().objects[0];
        let mut held = Held { world, command, placed };
        for t in ends_of_steps(READ_S, setup.dt_s) {
            held.command.sigma[0] = ramp(t / CLOSED_S).0;
            let (from, to) = LETS_GO_S;
            held.person(((to - t) / (to - from)).clamp(0.0, 1.0));
            held.step(recorder)?;
        }
        Ok(held)
    }

    /// A person holds the object at its place during the next step, with this part of the full grasp.
    fn person(&mut self, part: f64) {
        let (state, model) = (self.world.state(), self.world.model());
        let (pose, (linear, angular)) = (state.objects[0], state.object_velocity(model, 0));
        let inertia = model.objects()[0].inertia;
        let least = inertia.x_axis.x.min(inertia.y_axis.y).min(inertia.z_axis.z);
        let damping = |stiffness: f64, mass: f64| 2.0 * (stiffness * mass).sqrt();
        let away = pose.translation - self.placed.translation;
        let turned = (pose.rotation * self.placed.rotation.inverse()).to_scaled_axis();
        let force = -PERSON * away - damping(PERSON, MASS) * linear;
        let torque = -PERSON_TURN * turned - damping(PERSON_TURN, least) * angular;
        let force = force.clamp_length_max(PERSON_MOST.0) * part;
        let torque = torque.clamp_length_max(PERSON_MOST.1) * part;
        if part > 0.0 {
            self.world.push(0, force, torque);
        }
    }

    fn step(&mut self, recorder: &mut Recorder) -> Result<()> {
        recorder.step(&mut *self.world, &self.command)
    }

    fn lost(&self) -> Result<bool> {
        let pressed: f64 = forces(own(&*self.world)?).iter().map(|(_, force)| force.length()).sum();
        let moved = self.world.state().objects[0].translation - self.placed.translation;
        Ok(moved.length() > LOST_M || pressed < LOST_N)
    }
}

/// Our constants without gravity, and the wrist fixed.
fn weightless(dt_s: f64) -> Config {
    bolted(Config { gravity: Vec3::ZERO, sleeping: false, ..Config::with_step(dt_s) })
}

fn hand(setup: &Setup) -> Result<Arc<Hand>> {
    setup.hand.map_or_else(softhand, |hand| Ok(Arc::clone(hand)))
}

/// The paper's standard motor, or its stronger one.
fn published(hand: &Hand, standard: f64, strong: f64) -> Option<f64> {
    match &*hand.name {
        "softhand" => Some(standard),
        "softhand_strong" => Some(strong),
        _ => None,
    }
}

/// The case's figure: the mean's distance from the published value.
fn finding(recorder: &mut Recorder, measured: Measured, within_percent: f64) -> Finding {
    let departure = measured.departure().map(|part| 100.0 * part);
    let name = format!("distance of the mean from {} {}", measured.published.unwrap_or(f64::NAN), measured.unit);
    recorder.measured = Some(measured);
    let error = Figure { value: departure, ..Figure::bounded(&name, 0.0, "%", within_percent) };
    recorder.finding(error)
}

/// Force between the halves of the split cylinder, in the mean over the planes through its axis, since the paper does not
/// say how the split lay.
pub fn split_cylinder(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = hand(setup)?;
    let cylinder = Shape::Cylinder { radius: 0.0225, half_length: 0.06 };
    let across_fingers = Rotation::from_rotation_x(FRAC_PI_2);
    let mut placements = Vec::new();
    for place in ON_CYLINDER {
        let mut held = Held::close(setup, recorder, &hand, (&cylinder, across_fingers), place)?;
        let n = steps(READ_END_S - READ_S, setup.dt_s);
        let mut sum = 0.0;
        for _ in 0..n {
            held.step(recorder)?;
            let pose = held.world.state().objects[0];
            let (axis, normal) = (pose.rotation * Vec3::Z, pose.rotation * Vec3::X);
            let forces = forces(own(&*held.world)?);
            for k in 0..PLANES {
                let turned = Rotation::from_axis_angle(axis, PI * k as f64 / PLANES as f64) * normal;
                sum += between_halves(&forces, pose.translation, turned);
            }
        }
        let force = sum / (n as usize * PLANES) as f64;
        placements.push((place.0.to_owned(), (!held.lost()?).then_some(force)));
    }
    let measured = Measured {
        quantity: "force between the halves of a cylinder".to_owned(),
        unit: "N".to_owned(),
        hand: hand.name.clone(),
        published: published(&hand, 20.0, 28.0),
        placements,
    };
    Ok(finding(recorder, measured, 20.0))
}

/// The largest torque about its axis that the disc bears before it has turned by 30 degrees in the hand.
pub fn disc_torque(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = hand(setup)?;
    let disc = Shape::Cylinder { radius: 0.0475, half_length: 0.01 };
    let flat = Rotation::from_rotation_y(FRAC_PI_2);
    let mut placements = Vec::new();
    for place in ON_DISC {
        let mut held = Held::close(setup, recorder, &hand, (&disc, flat), place)?;
        let lost = held.lost()?;
        let torque = if lost { None } else { Some(turned(setup, recorder, &mut held)?) };
        placements.push((place.0.to_owned(), torque));
    }
    let measured = Measured {
        quantity: "torque that a disc bears".to_owned(),
        unit: "N·m".to_owned(),
        hand: hand.name.clone(),
        published: published(&hand, 2.0, 3.5),
        placements,
    };
    Ok(finding(recorder, measured, 50.0))
}

fn turned(setup: &Setup, recorder: &mut Recorder, held: &mut Held) -> Result<f64> {
    let start = held.world.state().objects[0].rotation;
    let axis = start * Vec3::Z;
    let mut torque = 0.0;
    while torque < MOST_TORQUE {
        held.world.push(0, Vec3::ZERO, axis * torque);
        held.step(recorder)?;
        let turn = held.world.state().objects[0].rotation * start.inverse();
        if turn.to_scaled_axis().length() > TURNED {
            break;
        }
        torque += TORQUE_RATE * setup.dt_s;
    }
    Ok(torque)
}

/// Time from the command to 95 % of the fist, s. The mean over that time and the largest power of the motor, W, in parts
/// of [`WINDOW_S`], are placements of the measurement.
pub fn closing(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = hand(setup)?;
    let model = Model::new(weightless(setup.dt_s), Some(Arc::clone(&hand)))?;
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    command.sigma[0] = 1.0;
    let mut ledger = Ledger::new(own(&*world)?);
    let mut trace = Vec::new();
    for _ in 0..steps(FIST_S, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
        ledger.step(own(&*world)?, &command);
        trace.push((world.state().q.iter().sum::<f64>(), ledger.works.motors));
    }
    let fist = trace.last().context("the run has steps")?.0;
    let reached = |part: f64| {
        let k = trace.iter().position(|(closed, _)| *closed >= part * fist).unwrap_or(trace.len() - 1);
        (k + 1) as f64 * setup.dt_s
    };
    let (t95, t99) = (reached(0.95), reached(0.99));
    let work_until = |t: f64| trace[(steps(t, setup.dt_s) as usize).clamp(1, trace.len()) - 1].1;
    let window = (steps(WINDOW_S, setup.dt_s) as usize).max(1);
    let power = |pair: &[(f64, f64)]| (pair[pair.len() - 1].1 - pair[0].1) / ((pair.len() - 1) as f64 * setup.dt_s);
    let peak = trace.windows(window + 1).map(power).fold(0.0, f64::max);
    let mean = work_until(t99) / t99;
    let row = |name: &str, value: f64| (name.to_owned(), Some(value));
    recorder.measured = Some(Measured {
        quantity: "closing in air".to_owned(),
        unit: "s, W".to_owned(),
        hand: hand.name.clone(),
        published: None,
        placements: vec![
            row("to 95 %, s", t95),
            row("to 99 %, s", t99),
            row("mean power, W", mean),
            row("largest power, W", peak),
        ],
    });
    Ok(recorder.finding(Figure::bounded("mean power of the motor", mean, "W", 6.0)))
}

/// After this time the fist is closed, s, and time over which a power is averaged, s.
const FIST_S: f64 = 5.0;
const WINDOW_S: f64 = 0.02;
