//! The hand as a mechanism, without contact: energy, a stiff joint, the path of rolling joints.

use super::case::{Case, Finding};
use super::setup::{Setup, ends_of_steps, ramp, steps};
use super::synergy::world_of;
use crate::case_report::Figure;
use crate::energy::Stored;
use crate::recorder::Recorder;
use crate::rigs::{Finger, bare_chain, bolted, fingers, softhand};
use anyhow::Result;
use palmares_models::hand::{Hand, HingeKind};
use palmares_models::{Pose, Rotation};
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::{Command, Config, Model, State};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "chain_energy",
        "SoftHand without springs and dampers falls as a chain for 2 s: energy drift",
        falling_chain,
    ),
    Case::ours(
        "chain_energy_springs",
        "undamped SoftHand swings on its springs for 2 s from 0.5 rad a joint: energy drift",
        sprung_chain,
    ),
    Case::ours(
        "spring_joint_stiff",
        "a fingertip of 1.36e-6 kg m^2 on 0.5 N m/rad and 0.03 N m s/rad, released from 0.5 rad",
        stiff_joint,
    ),
    Case::ours(
        "rolling_joint_path",
        "SoftHand's rolling joints on p = 2r u(th/2) + l u(th) while it closes",
        rolling_path,
    ),
];

/// The hand released with its fingers level; nothing takes or gives energy.
fn chain(setup: &Setup, recorder: &mut Recorder, springs: bool, bend: f64) -> Result<Finding> {
    let hand = Arc::new(bare_chain(springs)?);
    let model = Arc::new(Model::new(bolted(Config::with_step(setup.dt_s)), Some(hand))?);
    let level = Pose::from_rotation(Rotation::from_rotation_y(std::f64::consts::FRAC_PI_2));
    let mut state = State::at_rest(&model, level, &[]);
    state.q.fill(bend);
    let mut world = setup.start(Arc::clone(&model), state)?;
    let command = Command::stay(&model, level);
    let start = Stored::of(&model, world.state()).total();
    let (mut drift, mut motion): (f64, f64) = (0.0, 0.0);
    for _ in 0..steps(2.0, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
        let now = Stored::of(&model, world.state());
        drift = drift.max((now.total() - start).abs());
        motion = motion.max(now.kinetic);
    }
    Ok(recorder.finding(Figure::new(
        "largest change of energy, of the largest kinetic one",
        100.0 * drift / motion,
        "%",
    )))
}

/// Largest change of the energy in 2 s of falling, against the largest kinetic energy, in percent.
pub fn falling_chain(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    chain(setup, recorder, false, 0.0)
}

/// The same on springs, from 0.5 rad a joint.
pub fn sprung_chain(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    chain(setup, recorder, true, 0.5)
}

/// Largest error of a stiff joint against `q₀ (s₂ e^{s₁ t} − s₁ e^{s₂ t})/(s₂ − s₁)`, the roots of
/// `I s² + d s + k`. Explicit integration would need steps below 91 µs.
pub fn stiff_joint(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (inertia, k, d, q0) = (1.36e-6, 0.5, 0.03, 0.5);
    let tip = Finger {
        kind: HingeKind::Revolute,
        base_from_hinge: Pose::IDENTITY,
        mass: 0.01,
        inertia,
        stiffness: k,
        damping: d,
        tension: 2.0,
        geoms: Vec::new(),
    };
    let hand = Arc::new(fingers("fingertip", Vec::new(), vec![tip])?);
    let model = Model::new(bolted(Config::with_step(setup.dt_s)), Some(hand))?;
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
    state.q[0] = q0;
    let mut world = setup.start(model, state)?;
    let command = Command::stay(world.model(), Pose::IDENTITY);
    let root = (d * d - 4.0 * k * inertia).sqrt();
    let (s1, s2) = (2.0 * k / (-d - root), (-d - root) / (2.0 * inertia));
    let mut worst: f64 = 0.0;
    for t in ends_of_steps(0.3, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
        let exact = q0 * (s2 * (s1 * t).exp() - s1 * (s2 * t).exp()) / (s2 - s1);
        worst = worst.max((world.state().q[0] - exact).abs());
    }
    Ok(recorder.finding(Figure::new("largest joint error", worst, "rad")))
}

/// Largest distance of a point of a rolling joint's outer link from the textbook's path, over all joints of the
/// closing SoftHand, m. Two cylinders of radius r roll on each other: the outer one's centre circles the inner one's
/// at 2r by half the angle, and a point l beyond it turns by the whole, `p(θ) = 2r u(θ/2) + l u(θ)`.
pub fn rolling_path(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut hand = Hand::clone(&*softhand()?);
    // Fingers pass each other: all joints shall reach 90°.
    hand.links.iter_mut().for_each(|link| link.geoms.clear());
    let hand = Arc::new(hand);
    let (mut world, mut command) = world_of(Arc::clone(&hand), setup)?;
    let mut kin = Kinematics::default();
    let (mut worst, mut widest): (f64, f64) = (0.0, 0.0);
    for t in ends_of_steps(1.5, setup.dt_s) {
        command.sigma[0] = ramp(t).0;
        recorder.step(&mut *world, &command)?;
        let state = world.state();
        kin.update(&hand, state.base, &state.q);
        for (i, link) in hand.links.iter().enumerate() {
            let (Some(parent), Some(joint)) = (link.parent, &link.joint) else { continue };
            let [inner, outer] = joint.hinges.as_slice() else { continue };
            let inner_centre = kin.pose[parent] * inner.parent_from_hinge;
            let reach = outer.parent_from_hinge.translation;
            let (two_r, length) = (reach.length(), 0.03);
            // In the plane of the joint: e₁ from centre to centre at θ = 0.
            let e1 = inner_centre.rotation * reach / two_r;
            let e2 = (inner_centre.rotation * inner.axis).cross(e1);
            let u = |angle: f64| e1 * angle.cos() + e2 * angle.sin();
            let theta = 2.0 * state.q[joint.coordinate];
            let exact = inner_centre.translation + u(0.5 * theta) * two_r + u(theta) * length;
            // The outer frame's own direction of e₁ at θ = 0.
            let along = outer.parent_from_hinge.rotation.inverse() * (reach / two_r) * length;
            worst = worst.max((kin.pose[i].transform_point(along) - exact).length());
            widest = widest.max(theta);
        }
    }
    if widest < 1.5 {
        anyhow::bail!("the joints closed to {widest} rad only");
    }
    Ok(recorder.finding(Figure::new("largest distance from the path", worst, "m")))
}
