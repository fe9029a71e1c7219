//! Time of every 10 ms of a grasp of a pan, once closed by one tendon and once by a servo on every joint: Fig. 5
//! of Rocchi and Hauser (2016), whose emulated transmission cost hardly more than the plain one.

use anyhow::{Context, Result};
use palmares_bench::cases::grasp::{CHOSEN, Grasp, scene};
use palmares_bench::cases::{ramp, risen, steps};
use palmares_bench::engine::{EngineFactory, OwnFactory};
use palmares_bench::rigs::softhand;
use palmares_models::hand::{Hand, Motor, MotorNumbers, Tendon};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::statics::equilibrium::ClosedForm;
use palmares_sim::{Command, Config, Model, State};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Step and tick, s.
const STEP_S: f64 = 1e-3;
const TICK_S: f64 = 1e-2;
const TIME_S: f64 = 3.0;
/// Position of the pan's disc along its handle, m.
const DISC_M: f64 = 0.115;

/// One way to close the hand.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Ticks {
    /// `tendon` or `joints`.
    pub name: String,
    /// Description.
    pub about: String,
    /// CPU time of every tick, ms; the median over the repeats.
    pub ms: Vec<f64>,
    /// Whether the pan was lifted.
    pub lifted: bool,
}

/// Plays both.
pub fn measure(repeats: usize) -> Result<Vec<Ticks>> {
    let tendon = softhand()?;
    let joints = Arc::new(servo_on_every_joint(&tendon)?);
    let ways = [
        ("tendon", "one tendon over 19 joints (adaptive synergy)", tendon),
        ("joints", "a servo on each of the 19 joints", joints),
    ];
    let mut all = Vec::new();
    for (name, about, hand) in ways {
        let plays = (0..repeats).map(|_| play(&hand)).collect::<Result<Vec<_>>>()?;
        let median = |k: usize| {
            let mut times: Vec<f64> = plays.iter().map(|(ms, _)| ms[k]).collect();
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        };
        let ms = (0..plays[0].0.len()).map(median).collect();
        all.push(Ticks { name: name.into(), about: about.into(), ms, lifted: plays[0].1 });
    }
    Ok(all)
}

/// The same hand without the transmission: every joint follows the tendon's path by itself.
fn servo_on_every_joint(hand: &Hand) -> Result<Hand> {
    let motor = hand.motors.first().context("the hand has a motor")?;
    let tendon = hand.tendons.first().context("the hand has a tendon")?;
    let form = ClosedForm::new(hand)?;
    let (q, _) = form.solve(&[motor.wound(1.0)], &vec![0.0; hand.coordinates.len()]);
    let mut plain = hand.clone();
    (plain.motors, plain.tendons) = (Vec::new(), Vec::new());
    for (i, c) in hand.coordinates.iter().enumerate() {
        // The servo's spring yields to the joint's own, against which it must hold q.
        let stretch = c.stiffness * (q[i] - c.rest) / tendon.stiffness;
        plain.motors.push(Motor {
            name: c.name.clone(),
            numbers: MotorNumbers { scaling: q[i] + stretch, offset: 0.0, ..motor.numbers },
        });
        plain.tendons.push(Tendon {
            name: c.name.clone(),
            motors: vec![(i, 1.0)],
            moment_arms: vec![(i, 1.0)],
            elements: Vec::new(),
            ..tendon.clone()
        });
    }
    Ok(plain)
}

/// A pan of 0.3 kg: a thick handle in place of the capsule of the grasp cases, and a disc of 10 cm outside
/// the hand. CPU time of every tick, and whether it was lifted.
fn play(hand: &Arc<Hand>) -> Result<(Vec<f64>, bool)> {
    let grasp = Grasp::capsule();
    let config = Config::with_step(STEP_S);
    let (_, handle, base) = scene(&softhand()?, config.clone(), &grasp, CHOSEN)?;
    let handle = handle.objects[0];
    let across = Rotation::from_rotation_x(FRAC_PI_2);
    let disc = Shape::Cylinder { radius: 0.05, half_length: 0.008 };
    let parts =
        vec![(Pose::IDENTITY, grasp.shape), (Pose::from_parts(Vec3::new(0.0, 0.0, DISC_M), across), disc)];
    let pan = Object::new("pan", parts, grasp.mass, 0.8, 0.0)?;
    let mut model = Model::new(config, Some(Arc::clone(hand)))?;
    model.add_object(Arc::new(pan))?;
    let stand = Shape::Box { half_extents: [0.02, 0.035, 0.02], rounding: 0.0 };
    let low = handle.translation - Vec3::new(0.0, 0.0, 0.04 + 0.02 + 1e-5);
    model.add_static("stand", &stand, Pose::from_translation(low), 0.5)?;
    let state = State::at_rest(&model, base, &[handle]);
    let low = state.objects[0].translation.z;
    let mut command = Command::stay(&model, base);
    let mut world = OwnFactory.start(Arc::new(model), state)?;
    let per_tick = steps(TICK_S, STEP_S);
    let mut ms = Vec::new();
    for tick in 0..steps(TIME_S, TICK_S) {
        let mut spent = 0.0;
        for k in 0..per_tick {
            let t = (tick * per_tick + k + 1) as f64 * STEP_S;
            command.sigma.fill(CHOSEN.sigma * ramp(t / 0.5).0);
            let (rise, rate) = ramp((t - 0.8) / 1.2);
            command.base = risen(base, 0.1 * rise, 0.1 * rate / 1.2);
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

    #[test]
    fn servos_on_every_joint_close_the_hand_where_the_tendon_does() {
        let tendon = softhand().expect("built in");
        let joints = servo_on_every_joint(&tendon).expect("a hand");
        let n = tendon.coordinates.len();
        let s: Vec<f64> = joints.motors.iter().map(|motor| motor.wound(1.0)).collect();
        let (q, _) = ClosedForm::new(&joints).expect("solvable").solve(&s, &vec![0.0; n]);
        let one = tendon.motors[0].wound(1.0);
        let (expected, _) = ClosedForm::new(&tendon).expect("solvable").solve(&[one], &vec![0.0; n]);
        for (a, b) in q.iter().zip(&expected) {
            assert!((a - b).abs() < 1e-9, "{q:?} {expected:?}");
        }
    }
}
