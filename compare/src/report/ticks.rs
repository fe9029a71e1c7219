//! Time of every 10 ms of a grasp of a pan, once closed by the tendons and once by a servo on every joint: Fig. 5 of Rocchi
//! and Hauser (2016), whose emulated transmission cost hardly more than the plain one. Theirs is the ReFlex; the SoftHand
//! stands beside.

use anyhow::{Context, Result};
use palmares_bench::cases::grasp::{CHOSEN, Grasp, scene};
use palmares_bench::cases::{ramp, risen, steps};
use palmares_bench::engine::{EngineFactory, OwnFactory};
use palmares_bench::rigs::softhand;
use palmares_models::hand::{Hand, Motor, MotorNumbers, Tendon};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::statics::equilibrium::solve_free;
use palmares_sim::{Command, Config, Model, State};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Step and tick, s.
const STEP_S: f64 = 1e-3;
const TICK_S: f64 = 1e-2;
const TIME_S: f64 = 3.6;
/// The hand closes until the first and is lifted by 10 cm from the second to the third, s.
const CLOSED_S: f64 = 1.2;
const LIFT_S: [f64; 2] = [1.6, 2.8];
/// Position of the pan's disc along its handle, m.
const DISC_M: f64 = 0.115;

/// One way to close a hand.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Ticks {
    /// The hand.
    #[serde(default)]
    pub hand: String,
    /// `tendon` or `joints`.
    pub name: String,
    /// Description.
    pub about: String,
    /// CPU time of every tick, ms; the median over the repeats.
    pub ms: Vec<f64>,
    /// Whether the pan was lifted.
    pub lifted: bool,
}

/// A hand over a pan of 0.3 kg with a thick handle on a post.
struct Rig {
    hand: Arc<Hand>,
    /// What its motors are set to.
    sigma: Vec<f64>,
    /// Where it stands.
    base: Pose,
    /// The handle, along z of its frame; its radius, m, and where it lies.
    handle: Shape,
    radius_m: f64,
    pan: Pose,
}

/// Plays each hand in both ways.
pub fn measure(repeats: usize) -> Result<Vec<Ticks>> {
    let ways = [
        (reflex()?, "tendon", "ReFlex, 3 tendons over 6 joints and a drive"),
        (plain(reflex()?)?, "joints", "ReFlex, a servo on each of its 7 joints"),
        (soft()?, "tendon", "SoftHand, one tendon over 19 joints"),
        (plain(soft()?)?, "joints", "SoftHand, a servo on each of its 19 joints"),
    ];
    let mut all = Vec::new();
    for (rig, name, about) in ways {
        let plays = (0..repeats).map(|_| play(&rig)).collect::<Result<Vec<_>>>()?;
        let median = |k: usize| {
            let mut times: Vec<f64> = plays.iter().map(|(ms, _)| ms[k]).collect();
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        };
        let ms = (0..plays[0].0.len()).map(median).collect();
        let hand = rig.hand.name.clone();
        all.push(Ticks { hand, name: name.into(), about: about.into(), ms, lifted: plays[0].1 });
    }
    Ok(all)
}

/// The SoftHand over a handle in place of the capsule of the grasp cases.
fn soft() -> Result<Rig> {
    let (hand, grasp) = (softhand()?, Grasp::capsule());
    let (_, state, base) = scene(&hand, Config::with_step(STEP_S), &grasp, CHOSEN)?;
    let sigma = vec![CHOSEN.sigma; hand.motors.len()];
    Ok(Rig { hand, sigma, base, handle: grasp.shape, radius_m: 0.04, pan: state.objects[0] })
}

/// The ReFlex over a handle between its fingers.
fn reflex() -> Result<Rig> {
    let hand = Hand::builtin("reflex").context("the ReFlex is built in")?;
    let down = Rotation::from_rotation_x(PI);
    let base = Pose::from_parts(-(down * Vec3::new(REFLEX_M[0], 0.0, REFLEX_M[1])), down);
    let handle = Shape::Capsule { radius: 0.03, half_length: 0.05 };
    let pan = Pose::from_rotation(Rotation::from_rotation_x(-FRAC_PI_2));
    Ok(Rig { hand, sigma: vec![0.9, 0.9, 0.9, 0.0], base, handle, radius_m: 0.03, pan })
}

/// Place of the handle's middle in the ReFlex's frame, x and z, m.
const REFLEX_M: [f64; 2] = [0.015, 0.13];

/// The same hand without the transmission: a servo on every joint turns it to where the tendons do on air.
fn plain(rig: Rig) -> Result<Rig> {
    let Rig { hand, sigma, .. } = &rig;
    let s: Vec<f64> =
        hand.tendons.iter().map(|tendon| tendon.wound(&hand.motors, |motor| sigma[motor])).collect();
    let open: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    let q = solve_free(hand, &s, &vec![0.0; open.len()], &open)?.q;
    let mut servos = Hand::clone(hand);
    (servos.motors, servos.tendons) = (Vec::new(), Vec::new());
    for (i, c) in hand.coordinates.iter().enumerate() {
        let moves = |tendon: &&Tendon| {
            tendon.moment_arms.iter().any(|(k, _)| *k == i)
                || tendon.elements.iter().any(|element| element.coordinate == i)
        };
        let tendon = hand.tendons.iter().find(moves).context("a tendon moves every joint")?;
        let motor = &hand.motors[tendon.motors[0].0];
        // The servo's spring yields to the joint's own, against which it must hold q.
        let stretch = c.stiffness * (q[i] - c.rest) / tendon.stiffness;
        servos.motors.push(Motor {
            name: c.name.clone(),
            numbers: MotorNumbers { scaling: q[i] + stretch, offset: 0.0, ..motor.numbers },
        });
        servos.tendons.push(Tendon {
            name: c.name.clone(),
            motors: vec![(i, 1.0)],
            moment_arms: vec![(i, 1.0)],
            elements: Vec::new(),
            ..tendon.clone()
        });
    }
    Ok(Rig { sigma: vec![1.0; servos.motors.len()], hand: Arc::new(servos), ..rig })
}

/// CPU time of every tick, ms, and whether the pan was lifted: a handle, and a disc of 10 cm outside the hand.
fn play(rig: &Rig) -> Result<(Vec<f64>, bool)> {
    let across = Rotation::from_rotation_x(FRAC_PI_2);
    let disc = Shape::Cylinder { radius: 0.05, half_length: 0.008 };
    let parts =
        vec![(Pose::IDENTITY, rig.handle.clone()), (Pose::from_parts(Vec3::Z * DISC_M, across), disc)];
    let pan = Object::new("pan", parts, 0.3, 0.8, 0.0)?;
    let mut model = Model::new(Config::with_step(STEP_S), Some(Arc::clone(&rig.hand)))?;
    model.add_object(Arc::new(pan))?;
    let stand = Shape::Box { half_extents: [0.02, 0.035, 0.02], rounding: 0.0 };
    let below = rig.pan.translation - Vec3::Z * (rig.radius_m + 0.02 + 1e-5);
    model.add_static("stand", &stand, Pose::from_translation(below), 0.5)?;
    let state = State::at_rest(&model, rig.base, &[rig.pan]);
    let low = state.objects[0].translation.z;
    let mut command = Command::stay(&model, rig.base);
    let mut world = OwnFactory.start(Arc::new(model), state)?;
    let per_tick = steps(TICK_S, STEP_S);
    let mut ms = Vec::new();
    for tick in 0..steps(TIME_S, TICK_S) {
        let mut spent = 0.0;
        for k in 0..per_tick {
            let t = (tick * per_tick + k + 1) as f64 * STEP_S;
            for (set, sigma) in command.sigma.iter_mut().zip(&rig.sigma) {
                *set = sigma * ramp(t / CLOSED_S).0;
            }
            let (rise, rate) = ramp((t - LIFT_S[0]) / (LIFT_S[1] - LIFT_S[0]));
            command.base = risen(rig.base, 0.1 * rise, 0.1 * rate / (LIFT_S[1] - LIFT_S[0]));
            spent += world.step(&command)?.total_s;
        }
        ms.push(1e3 * spent);
    }
    let lifted = world.state().objects[0].translation.z > low + 0.04;
    Ok((ms, lifted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_sim::statics::equilibrium::ClosedForm;

    #[test]
    fn servos_on_every_joint_close_a_hand_where_its_tendons_do() {
        let Rig { hand: tendon, sigma, .. } = soft().expect("built in");
        let Rig { hand: joints, .. } = plain(soft().expect("built in")).expect("a hand");
        let n = tendon.coordinates.len();
        let s: Vec<f64> = joints.motors.iter().map(|motor| motor.wound(1.0)).collect();
        let (q, _) = ClosedForm::new(&joints).expect("solvable").solve(&s, &vec![0.0; n]);
        let one = tendon.motors[0].wound(sigma[0]);
        let (expected, _) = ClosedForm::new(&tendon).expect("solvable").solve(&[one], &vec![0.0; n]);
        for (a, b) in q.iter().zip(&expected) {
            assert!((a - b).abs() < 1e-9, "{q:?} {expected:?}");
        }
    }

    #[test]
    fn both_hands_lift_the_pan_in_both_ways() {
        for ticks in measure(1).expect("they play") {
            println!(
                "{} {} {}",
                ticks.about,
                ticks.lifted,
                ticks.ms.iter().sum::<f64>() / ticks.ms.len() as f64
            );
            assert!(ticks.lifted, "{}", ticks.about);
        }
    }
}
