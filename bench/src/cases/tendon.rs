//! Tendons beyond the free closure: a blocked joint, a slack cable, the energy of a cycle.

use super::case::{Case, Finding};
use super::scene::SceneBuilder;
use super::setup::{Setup, ends_of_steps, ramp, steps};
use super::synergy::world_of;
use crate::case_report::Figure;
use crate::energy::{Ledger, Stored};
use crate::recorder::Recorder;
use crate::rigs::{Finger, bolted, fingers, softhand};
use anyhow::{Context, Result};
use palmares_models::hand::{Hand, HingeKind};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, Config, Model, State};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "syn_joint_blocked",
        "closed SoftHand with one joint clamped, against the closed form without its column",
        joint_blocked,
    ),
    Case::ours(
        "syn_slack",
        "a closed joint let go at once swings as a damped oscillator while its cable hangs slack",
        slack,
    ),
    Case::ours(
        "syn_energy",
        "SoftHand closes on a fixed bar and opens: work of the motor against what was dissipated",
        cycle,
    ),
];

/// Largest joint error at rest of a free hand one joint of which is clamped between two limits, against the
/// equilibrium with the clamped column of R removed: `f = (s − R q₀ − r_b (q_b − q₀_b))/(Σ' r²/E + 1/K)`,
/// `q' = q₀ + r f/E`. The error of the tension, in rad of the tendon's own stretch f/K, counts as well.
pub fn joint_blocked(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut hand = Hand::clone(&*softhand()?);
    let blocked = hand.coordinate("index_inner").context("the SoftHand has a joint `index_inner`")?;
    let at = 0.1;
    (hand.coordinates[blocked].lower, hand.coordinates[blocked].upper) = (at, at);
    let hand = Arc::new(hand);
    let (mut world, mut command) = world_of(Arc::clone(&hand), setup)?;
    let sigma = 0.3;
    for t in ends_of_steps(4.0, setup.dt_s) {
        command.sigma[0] = sigma * ramp(t).0;
        recorder.step(&mut *world, &command)?;
    }
    let tendon = &hand.tendons[0];
    let state = world.state();
    // The clamp yields a little under the tendon: the joint's place is read, the rest is predicted.
    let mut stretch = hand.motors[0].wound(sigma);
    let mut compliance = 1.0 / tendon.stiffness;
    for &(c, r) in &tendon.moment_arms {
        let joint = &hand.coordinates[c];
        if c == blocked {
            stretch -= r * state.q[c];
        } else {
            stretch -= r * joint.rest;
            compliance += r * r / joint.stiffness;
        }
    }
    let f = stretch / compliance;
    let mut expected: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    for &(c, r) in &tendon.moment_arms {
        expected[c] += r * f / hand.coordinates[c].stiffness;
    }
    expected[blocked] = state.q[blocked];
    let joints = state.q.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let error = joints.max((state.tension[0] - f).abs() / tendon.stiffness);
    if (state.q[blocked] - at).abs() > 5e-3 {
        anyhow::bail!("the clamp let the joint go to {} rad", state.q[blocked]);
    }
    Ok(recorder.finding(Figure::new("largest joint error", error, "rad")))
}

/// Largest joint error over half a second after the cable's release, against the damped oscillator `q₀
/// e^{−ζωt} (cos ω_d t + ζω/ω_d sin ω_d t)`. A cable that pushed, or pulled while slack, is a failure.
pub fn slack(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (inertia, k, d) = (2e-4, 0.5, 2e-3);
    let finger = Finger {
        kind: HingeKind::Revolute,
        base_from_hinge: Pose::IDENTITY,
        mass: 0.01,
        inertia,
        stiffness: k,
        damping: d,
        tension: 10.0,
        geoms: Vec::new(),
    };
    let hand = Arc::new(fingers("oscillator", Vec::new(), vec![finger])?);
    let stiffness = hand.tendons[0].stiffness;
    let model = Model::new(bolted(Config::with_step(setup.dt_s)), Some(hand))?;
    // Held by the wound cable, at rest: K (s − q) = k q.
    let wound = 0.5;
    let q0 = wound * stiffness / (stiffness + k);
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
    state.q[0] = q0;
    let sigma = 0.5 + 0.5 * wound;
    state.motors[0].position = sigma;
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    command.sigma[0] = sigma;
    recorder.steps(&mut *world, &command, steps(0.1, setup.dt_s))?;
    if (world.state().q[0] - q0).abs() > 1e-6 {
        anyhow::bail!("the wound cable does not hold the joint: {} rad", world.state().q[0]);
    }
    command.sigma[0] = 0.0;
    let omega = (k / inertia).sqrt();
    let decay = 0.5 * d / inertia;
    let damped = (omega * omega - decay * decay).sqrt();
    let (mut worst, mut pulled): (f64, f64) = (0.0, 0.0);
    for t in ends_of_steps(0.5, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
        let phase = damped * t;
        let exact = q0 * (-decay * t).exp() * (phase.cos() + decay / damped * phase.sin());
        worst = worst.max((world.state().q[0] - exact).abs());
        pulled = pulled.max(world.state().tension[0].abs());
    }
    if pulled != 0.0 {
        anyhow::bail!("the slack cable carried {pulled} N m");
    }
    Ok(recorder.finding(Figure::new("largest joint error", worst, "rad")))
}

/// Energy audit of a cycle: the hand closes on a fixed bar, squeezes it and opens again. Dampers, friction
/// and servo took the motor's work over the closed cycle, `∮ f ds`, or springs still hold it. The figure is
/// the missing part, in percent of all the work the motor did while closing; a surplus goes to
/// `energy_gain_j`. The integrator itself and the impacts on joint limits take the missing part: the audit
/// does not count them.
pub fn cycle(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let bar = Shape::Capsule { radius: 0.0225, half_length: 0.06 };
    let across = Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let (mut world, mut command) =
        SceneBuilder::with_hand(Config::with_step(setup.dt_s), softhand()?, Pose::IDENTITY)?
            .fixed(&bar, Pose::from_parts(Vec3::new(0.045, 0.0, 0.175), across), 0.3)?
            .start(setup)?;
    let alone = "only our own engine keeps books of its forces";
    let mut ledger = Ledger::new(world.world().context(alone)?);
    let start = Stored::of(world.model(), world.state());
    let (mut spent, mut touched) = (0.0, 0.0f64);
    for t in ends_of_steps(3.0, setup.dt_s) {
        command.sigma[0] = 0.5 * (ramp(t / 0.8).0 - ramp((t - 1.2) / 0.8).0);
        recorder.step(&mut *world, &command)?;
        let before = ledger.works.motors;
        let own = world.world().context(alone)?;
        ledger.step(own, &command);
        spent += (ledger.works.motors - before).max(0.0);
        for contact in own.contact_forces() {
            touched = touched.max(contact.force.length());
        }
    }
    let end = Stored::of(world.model(), world.state());
    if touched < 10.0 || end.springs > 1e-9 {
        anyhow::bail!("no cycle: squeezed with {touched} N, {} J left in the springs", end.springs);
    }
    let works = ledger.works;
    let given = works.motors + works.servo + works.contacts + works.dampers;
    let missing = given - (end.total() - start.total());
    let error = Figure::new("energy missing from the books", 100.0 * missing.abs() / spent, "%");
    Ok(recorder.finding(error).with_energy_gain((-missing).max(0.0)))
}
