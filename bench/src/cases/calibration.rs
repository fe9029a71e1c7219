//! Measurements on the real SoftHand, repeated: Catalano, Grioli, Farnioli, Serio, Piazza, Bicchi, *Adaptive synergies for
//! the design and control of the Pisa/IIT SoftHand*, IJRR 33(5), 2014, section V-A with figures 18 and 19.
//!
//! The hand wore a glove with padded rubber surfaces. The grasp force was read from a split cylinder, 120 mm high and
//! 45 mm thick, with a six-axis sensor (ATI Nano17) between its halves; the holding torque from a disc, 20 mm high and
//! 95 mm wide. The largest readings were about 20 N along the sensor's z axis and 2 N·m; 28 N and 3.5 N·m with a stronger
//! motor. The paper does not say where the objects lay in the hand, how the split stood to it, or how often it was done.
//!
//! Here the wrist is fixed and a person lays the object into the hand, as in the paper's figure 20; the hand closes on a
//! full command with its motor on. Gravity is off: the object's weight is not published, and a sensor is zeroed with it.

use super::case::{Case, Finding};
use super::grasp_scene::{GraspStart, Lie, floating};
use super::instrument::{Closing, Held, body, own, weightless};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::energy::Ledger;
use crate::measured::Measured;
use crate::recorder::Recorder;
use crate::rigs;
use anyhow::Result;
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3, rotation};
use palmares_sim::{Command, Model, State};
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
        "SoftHand closes on a disc that is then turned: the torque that it bears; the real hand's: 2 N·m",
        disc_torque,
    ),
    Case::ours(
        "softhand_closing",
        "SoftHand closes in air: time to 95 % and to the fist, mean and largest power of its motor of 6 W",
        closing,
    ),
];

/// Friction of the objects, that of the grasp cases: with the glove's 1.16 a pair has 0.96. Their materials are not
/// published; rubber on dry plastics and metals has 0.5 to 1.
pub const FRICTION: f64 = 0.8;
/// The disc's torque grows by this, N·m/s, until it has turned by the angle, rad, or to the most that is tried, N·m.
const TURNING: (f64, f64, f64) = (1.0, PI / 6.0, 30.0);
/// After this time the fist is closed, s, and time over which a power is averaged, s.
const FIST_S: f64 = 8.0;
const WINDOW_S: f64 = 0.02;

/// Where a person lays the object: its centre from the middle place, along the fingers and across them, mm; turned about
/// the palm's normal and about the fingers' direction, degrees.
type Place = (&'static str, f64, f64, f64, f64);

/// Where the cylinder lies, across the roots of the fingers, and the disc, over the palm: along the fingers from the wrist
/// flange and across them, m.
const ROOTS: (f64, f64) = (0.184, -0.005);
const PALM: (f64, f64) = (0.156, -0.01);

/// Around these.
const PLACES: &[Place] = &[
    ("in the middle", 0.0, 0.0, 0.0, 0.0),
    ("8 mm to the wrist", -8.0, 0.0, 0.0, 0.0),
    ("8 mm to the fingertips", 8.0, 0.0, 0.0, 0.0),
    ("5 mm to the thumb", 0.0, 5.0, 0.0, 0.0),
    ("5 mm to the little finger", 0.0, -5.0, 0.0, 0.0),
    ("turned by 10 degrees", 0.0, 0.0, 10.0, 0.0),
    ("turned by -10 degrees", 0.0, 0.0, -10.0, 0.0),
    ("tilted by 5 degrees", 0.0, 0.0, 0.0, 5.0),
    ("tilted by -5 degrees", 0.0, 0.0, 0.0, -5.0),
];

/// The hand closed on a shape that a person has laid into it.
fn close_on(
    setup: &Setup,
    recorder: &mut Recorder,
    (hand, friction): (&Arc<Hand>, f64),
    (shape, upright, middle): (&Shape, Rotation, (f64, f64)),
    &(_, along_mm, across_mm, turn_deg, tilt_deg): &Place,
) -> Result<Held> {
    let turn = rotation::from_rpy([turn_deg.to_radians(), 0.0, tilt_deg.to_radians()]);
    let lie = Lie {
        object: body(shape, friction)?,
        hand_from_grip: Rotation::IDENTITY,
        grip_from_object: turn * upright,
        along_m: middle.0 + 1e-3 * along_mm,
        across_m: middle.1 + 1e-3 * across_mm,
        gap_m: 1e-3,
        pedestal_friction: 0.0,
    };
    let GraspStart { model, state, start } = floating(hand, weightless(setup.dt_s), &lie)?;
    Held::close(setup, recorder, (model, state, start), &Closing::full(hand))
}

/// The setup's hand, or the built-in one: the cases of the engine have a firmer hand.
fn hand(setup: &Setup) -> Result<Arc<Hand>> {
    setup.hand.map_or_else(|| rigs::hand("softhand"), |hand| Ok(Arc::clone(hand)))
}

/// The paper's value with the standard motor, or with its stronger one.
fn published(hand: &Hand, standard: f64, strong: f64) -> Option<f64> {
    match &*hand.name {
        "softhand" => Some(standard),
        "softhand_strong" => Some(strong),
        _ => None,
    }
}

/// The case's figure: the mean's distance from the published value.
fn finding(recorder: &mut Recorder, measured: Measured, within_percent: f64) -> Finding {
    let published = measured.published.map_or("a value".into(), |x| format!("{x} {}", measured.unit));
    let value = measured.departure().map(|part| 100.0 * part);
    let name = format!("distance of the mean from {published}");
    recorder.measured.push(measured);
    recorder.finding(Figure { value, ..Figure::bounded(&name, 0.0, "%", within_percent) })
}

/// Force between the halves of the split cylinder: of a split parallel to the palm, between palm and fingers, and the mean
/// over the planes through the cylinder's axis. The paper does not say how the split lay; its largest force is along the
/// sensor's z axis, which is normal to the split.
///
/// # Errors
/// The engine fails.
pub fn split_force(
    setup: &Setup,
    recorder: &mut Recorder,
    hand: &Arc<Hand>,
    friction: f64,
) -> Result<[Measured; 2]> {
    let cylinder = Shape::Cylinder { radius: 0.0225, half_length: 0.06 };
    let across_fingers = Rotation::from_rotation_x(FRAC_PI_2);
    let measured = |quantity: &str, published| Measured {
        quantity: quantity.to_owned(),
        unit: "N".to_owned(),
        hand: hand.name.clone(),
        published,
        placements: Vec::new(),
    };
    let mut palm =
        measured("force between the halves, split parallel to the palm", published(hand, 20.0, 28.0));
    let mut all = measured("force between the halves, mean over all splits", None);
    for place in PLACES {
        let mut held =
            close_on(setup, recorder, (hand, friction), (&cylinder, across_fingers, ROOTS), place)?;
        let [mean, parallel] = held.split_force(setup, recorder, Vec3::X)?;
        let kept = !held.lost()?;
        all.placements.push((place.0.to_owned(), kept.then_some(mean)));
        palm.placements.push((place.0.to_owned(), kept.then_some(parallel)));
    }
    Ok([palm, all])
}

/// The largest torque about its axis that the disc, flat in the palm like a lid, bears before it has turned by 30 degrees.
///
/// # Errors
/// The engine fails.
pub fn held_torque(
    setup: &Setup,
    recorder: &mut Recorder,
    hand: &Arc<Hand>,
    friction: f64,
) -> Result<Measured> {
    let disc = Shape::Cylinder { radius: 0.0475, half_length: 0.01 };
    let flat = Rotation::from_rotation_y(FRAC_PI_2);
    let mut placements = Vec::new();
    for place in PLACES {
        let mut held = close_on(setup, recorder, (hand, friction), (&disc, flat, PALM), place)?;
        let lost = held.lost()?;
        let torque = if lost { None } else { Some(held.turning_torque(setup, recorder, TURNING)?) };
        placements.push((place.0.to_owned(), torque));
    }
    Ok(Measured {
        quantity: "torque that a disc bears".to_owned(),
        unit: "N·m".to_owned(),
        hand: hand.name.clone(),
        published: published(hand, 2.0, 3.5),
        placements,
    })
}

/// The case of the split cylinder.
pub fn split_cylinder(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let [palm, all] = split_force(setup, recorder, &hand(setup)?, FRICTION)?;
    let finding = finding(recorder, palm, 20.0);
    recorder.measured.push(all);
    Ok(finding)
}

/// The case of the disc.
pub fn disc_torque(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let measured = held_torque(setup, recorder, &hand(setup)?, FRICTION)?;
    Ok(finding(recorder, measured, 50.0))
}

/// A closing in air on the full command.
#[derive(Clone, Copy, Debug)]
pub struct Closed {
    /// Time to 95 % of the fist, s: of the sum of all joint angles.
    pub to_95_s: f64,
    /// Time to 99 %, s.
    pub to_99_s: f64,
    /// Mean mechanical power of the motors until then, W.
    pub mean_w: f64,
    /// Their largest power over 20 ms, W.
    pub largest_w: f64,
}

/// Plays a closing in air.
///
/// # Errors
/// The engine fails.
pub fn close_in_air(setup: &Setup, recorder: &mut Recorder, hand: &Arc<Hand>) -> Result<Closed> {
    let model = Model::new(weightless(setup.dt_s), Some(Arc::clone(hand)))?;
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    command.sigma = Closing::full(hand).closed;
    let mut ledger = Ledger::new(own(&*world)?);
    let mut trace = vec![(world.state().q.iter().sum::<f64>(), 0.0)];
    for _ in 0..steps(FIST_S, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
        ledger.step(own(&*world)?, &command);
        trace.push((world.state().q.iter().sum::<f64>(), ledger.works.motors));
    }
    let (open, fist) = (trace[0].0, trace[trace.len() - 1].0);
    let reached = |part: f64| {
        let there = trace.iter().position(|(closed, _)| closed - open >= part * (fist - open));
        there.unwrap_or(trace.len() - 1)
    };
    let (k95, k99) = (reached(0.95), reached(0.99));
    let window = (steps(WINDOW_S, setup.dt_s) as usize).max(1);
    let powers = trace.windows(window + 1).map(|w| (w[window].1 - w[0].1) / (window as f64 * setup.dt_s));
    Ok(Closed {
        to_95_s: k95 as f64 * setup.dt_s,
        to_99_s: k99 as f64 * setup.dt_s,
        mean_w: trace[k99].1 / (k99.max(1) as f64 * setup.dt_s),
        largest_w: powers.fold(0.0, f64::max),
    })
}

/// Closing time and power. The figure is the mean power, which 6 W bound.
pub fn closing(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = hand(setup)?;
    let Closed { to_95_s, to_99_s, mean_w, largest_w } = close_in_air(setup, recorder, &hand)?;
    let one = |quantity: &str, unit: &str, published, value| Measured {
        quantity: quantity.to_owned(),
        unit: unit.to_owned(),
        hand: hand.name.clone(),
        published,
        placements: vec![("in air".to_owned(), Some(value))],
    };
    recorder.measured.extend([
        one("time to 95 % of the fist", "s", None, to_95_s),
        one("time to 99 % of the fist", "s", None, to_99_s),
        one("largest power of the motor over 20 ms", "W", None, largest_w),
    ]);
    Ok(recorder.finding(Figure::bounded("mean power of the motor to 99 % of the fist", mean_w, "W", 6.0)))
}
