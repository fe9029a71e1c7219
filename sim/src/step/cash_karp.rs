//! An explicit Runge–Kutta method for a hand that loses no energy: its motion is smooth and hardly stiff.
//!
//! The pair of orders 5 and 4 of Cash and Karp (1990), with their early exit after two stages. The first
//! stage is the dynamics at the start of the step; the difference of two orders gives the number of substeps.

use super::drive::Drive;
use super::method::Attempt;
use super::momentum;
use super::torque_free::{rate, turned};
use super::work::Work;
use crate::actuation::base;
use crate::bounds::{MAX_SUBSTEPS, STEP_WORK, hand_work};
use crate::dynamics::forward::accelerations;
use crate::dynamics::hand::HandDynamics;
use crate::model::Model;
use crate::state::{BaseReference, HandMotion, State};
use palmares_models::hand::{Hand, Motor};
use palmares_models::{Pose, Rotation, Vec3};

const STAGES: usize = 6;

/// Position of each stage in a substep.
const NODES: [f64; STAGES] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 3.0 / 5.0, 1.0, 7.0 / 8.0];

/// Weights of the earlier slopes in each stage.
const COUPLINGS: [[f64; STAGES - 1]; STAGES] = [
    [0.0; 5],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0],
    [3.0 / 10.0, -9.0 / 10.0, 6.0 / 5.0, 0.0, 0.0],
    [-11.0 / 54.0, 5.0 / 2.0, -70.0 / 27.0, 35.0 / 27.0, 0.0],
    [1631.0 / 55296.0, 175.0 / 512.0, 575.0 / 13824.0, 44275.0 / 110592.0, 253.0 / 4096.0],
];

/// Weights of the fifth order.
const WEIGHTS: [f64; STAGES] = [37.0 / 378.0, 0.0, 250.0 / 621.0, 125.0 / 594.0, 0.0, 512.0 / 1771.0];

/// Their differences from the weights of the fourth order.
const DIFFERENCES: [f64; STAGES] = [
    37.0 / 378.0 - 2825.0 / 27648.0,
    0.0,
    250.0 / 621.0 - 18575.0 / 48384.0,
    125.0 / 594.0 - 13525.0 / 55296.0,
    -277.0 / 14336.0,
    512.0 / 1771.0 - 1.0 / 4.0,
];

/// Weights of the second order, which needs only the first two stages.
const STEADY_WEIGHTS: [f64; 2] = [-3.0 / 2.0, 5.0 / 2.0];

/// Their differences from the first order.
const STEADY_DIFFERENCES: [f64; 2] = [-5.0 / 2.0, 5.0 / 2.0];

/// Below this part of the allowed difference the acceleration is constant: a hand at rest, a top in steady
/// precession. The other stages would give the same, and are skipped.
const STEADY: f64 = 1e-4;

/// Allowed difference of the orders in the velocities, relative, in the norm of the energy: the whipping
/// chain of a SoftHand's joints then changes its energy by a millionth of the kinetic energy in 2 s.
const TOLERANCE: f64 = 1e-7;

/// The same in absolute terms, for rounding, √J.
const ROUNDING: f64 = 1e-13;

/// A substep twice as long has 32 times the difference, and a little more.
const AMPLE: f64 = 1.0 / 64.0;

/// Distance, m or rad, and speed from its set point up to which a bolted base is at rest there.
const STANDS: f64 = 1e-12;

/// A motion that needs more than [`MAX_SUBSTEPS`], or more computing than this, is stiff, and implicit Euler
/// takes it.
const MAX_WORK: u64 = STEP_WORK / 10;

/// Memory of the method.
#[derive(Default)]
pub(crate) struct Stages {
    /// Coordinates and velocities at the start of the step, and of the substep.
    start: HandMotion,
    from: HandMotion,
    /// A stage's coordinates and velocities.
    at: HandMotion,
    /// Velocities and accelerations of the stages, and the rotation of their base.
    rates: [Vec<f64>; STAGES],
    changes: [Vec<f64>; STAGES],
    turns: [Rotation; STAGES],
    /// Diagonal of the mass matrix at the start of the step.
    weights: Vec<f64>,
}

/// Steps a hand without dampers that has no contact. Declines when a tendon or a limit acts, when a bolted base moves, or when the
/// motion is too stiff.
pub(super) fn step(model: &Model, state: &mut State, work: &mut Work, stages: &mut Stages) -> Attempt {
    let Some(hand) = model.hand() else { return Attempt::Declined };
    if work.drive.bolted && !base_stands(state) || acts(hand, state) {
        return Attempt::Declined;
    }
    stages.resize(model.hand_dofs());
    stages.start.read(state, model.hand_dofs());
    let attempt = substeps(model, hand, state, work, stages);
    match attempt {
        Attempt::Taken => {
            if work.drive.bolted {
                state.base = state.reference.pose;
                state.v[..6].fill(0.0);
            }
            state.tension.fill(0.0);
            state.earlier.smooth = false;
        }
        Attempt::Declined => {
            state.substeps = 0;
            stages.start.write(state);
            let HandMotion { base, q, v } = &stages.start;
            work.dynamics.update(model, false, *base, q, v);
            work.dynamics.add_pushes(model, &work.drive.pushes);
        }
    }
    attempt
}

/// Whether the set point of a bolted base is at rest, and the base at it.
fn base_stands(state: &State) -> bool {
    let reference = &state.reference;
    let still = |x: &f64| x.abs() < STANDS;
    state.v[..6].iter().all(still)
        && reference.linear.to_array().iter().all(still)
        && reference.angular.to_array().iter().all(still)
        && (reference.pose == state.base || base::way(reference, state.base).iter().all(still))
}

/// Divides the step into as many substeps as its error needs.
fn substeps(model: &Model, hand: &Hand, state: &mut State, work: &mut Work, stages: &mut Stages) -> Attempt {
    let (n, h, bolted) = (model.hand_dofs(), model.config().step_s, work.drive.bolted);
    stages.weights.clear();
    stages.weights.extend((0..n).map(|i| work.dynamics.mass[i * (n + 1)]));
    let free = !work.drive.servo_on && work.drive.pushes.is_empty();
    let due = free.then(|| momentum::due_after_flight(model, &work.dynamics, state));
    let mut parts = state.substeps.max(1);
    let (mut done, mut known) = (0, false);
    while done < parts {
        let (part, left) = (h / f64::from(parts), h * f64::from(parts - done) / f64::from(parts));
        if !known {
            stages.from.read(state, n);
            stages.at.read(state, n);
            if done > 0 {
                stage_dynamics(model, work, &stages.at);
            }
            if !stage_slopes(model, hand, state, work, stages, 0, left) {
                return Attempt::Declined;
            }
            if done == 0 {
                report_mount(model, work, stages);
            }
        }
        let (mut weights, mut differences) = (&WEIGHTS[..], &DIFFERENCES[..]);
        for stage in 1..STAGES {
            stages.go(&COUPLINGS[stage][..stage], part, bolted);
            work.outcome.work += hand_work(hand.links.len(), n) + (n * n * n / 6) as u64;
            if work.outcome.work > MAX_WORK {
                return Attempt::Declined;
            }
            stage_dynamics(model, work, &stages.at);
            if !stage_slopes(model, hand, state, work, stages, stage, left - NODES[stage] * part) {
                return Attempt::Declined;
            }
            if stage == 1 && stages.difference(&STEADY_DIFFERENCES, part, bolted) < STEADY {
                (weights, differences) = (&STEADY_WEIGHTS, &STEADY_DIFFERENCES);
                break;
            }
        }
        let difference = stages.difference(differences, part, bolted);
        if difference > 1.0 {
            (parts, done, known) = (2 * parts, 2 * done, true);
            if parts > MAX_SUBSTEPS {
                return Attempt::Declined;
            }
            continue;
        }
        stages.go(weights, part, bolted);
        stages.at.write(state);
        if acts(hand, state) || difference.is_nan() {
            return Attempt::Declined;
        }
        (done, known) = (done + 1, false);
        if difference < AMPLE && done % 2 == 0 && parts > 1 {
            (parts, done) = (parts / 2, done / 2);
        }
    }
    state.substeps = parts;
    if let Some(due) = due {
        momentum::keep(model, state, &mut work.dynamics, due, stages.start.base.translation);
    }
    Attempt::Taken
}

/// Whether a tendon, a limit, a spring across joints or a pin acts, or may act with a motor that its load slows.
fn acts(hand: &Hand, state: &State) -> bool {
    let stopped = hand.coordinates.iter().zip(&state.q).any(|(c, q)| *q < c.lower || *q > c.upper);
    let coupled = !(hand.springs.is_empty() && hand.linkages.is_empty());
    stopped
        || coupled
        || hand.motors.iter().any(Motor::slows)
        || hand.tendons.iter().any(|tendon| {
            let wound = tendon.wound(&hand.motors, |motor| state.motors[motor].position);
            let stretch = wound - tendon.length(&state.q);
            let mut speed = 0.0;
            tendon.gradient(&state.q, |c, r| speed += r * state.v[6 + c]);
            tendon.both_ways || tendon.stiffness * stretch > tendon.damping * speed
        })
}

/// Mass matrix and bias at a stage.
fn stage_dynamics(model: &Model, work: &mut Work, at: &HandMotion) {
    work.dynamics.update(model, work.drive.bolted, at.base, &at.q, &at.v);
    work.dynamics.add_pushes(model, &work.drive.pushes);
}

/// Velocities and accelerations at a stage, `left` before the end of the step. False if they are undefined.
fn stage_slopes(
    model: &Model,
    hand: &Hand,
    state: &State,
    work: &mut Work,
    stages: &mut Stages,
    stage: usize,
    left: f64,
) -> bool {
    let Work { dynamics, drive, forces, .. } = work;
    let (HandDynamics { mass, bias, .. }, Drive { servo_on, bolted, .. }) = (dynamics, drive);
    let Stages { at, rates, changes, turns, .. } = stages;
    let (rates, force) = (&mut rates[stage], &mut changes[stage]);
    rates.copy_from_slice(&at.v);
    let joints = force[6..].iter_mut().zip(&bias[6..]).zip(&hand.coordinates).zip(&at.q);
    for (((force, bias), c), q) in joints {
        *force = -bias - c.stiffness * (q - c.rest);
    }
    if !*bolted {
        for (force, bias) in force[..6].iter_mut().zip(&bias[..6]) {
            *force = -bias;
        }
        turns[stage] = rate(at.base.rotation, Vec3::new(at.v[3], at.v[4], at.v[5]));
        if *servo_on {
            let to = &state.reference;
            let pose = Pose::from_parts(
                to.pose.translation - to.linear * left,
                turned(to.pose.rotation, to.angular * -left),
            );
            let reference = BaseReference { pose, ..*to };
            let pull = base::pull(&model.config().base, &reference, at.base, &at.v);
            if stage == 0 {
                forces.base = pull;
            }
            for (force, pull) in force.iter_mut().zip(pull) {
                *force += pull;
            }
        }
    }
    accelerations(mass, if *bolted { 6 } else { 0 }, force)
}

/// Force that holds a bolted base, at the start of the step.
fn report_mount(model: &Model, work: &mut Work, stages: &Stages) {
    let n = model.hand_dofs();
    let Work { dynamics, drive, forces, .. } = work;
    if drive.bolted {
        for (k, force) in forces.base.iter_mut().enumerate() {
            let row = &dynamics.mass[k * n + 6..(k + 1) * n];
            *force =
                row.iter().zip(&stages.changes[0][6..]).fold(dynamics.bias[k], |sum, (m, a)| sum + m * a);
        }
    } else if !drive.servo_on {
        forces.base = [0.0; 6];
    }
}

impl Stages {
    fn resize(&mut self, n: usize) {
        for slopes in self.rates.iter_mut().chain(&mut self.changes) {
            slopes.resize(n, 0.0);
        }
    }

    /// Moves from the start of the substep along slopes.
    fn go(&mut self, weights: &[f64], part: f64, bolted: bool) {
        let Stages { from, at, rates, changes, turns, .. } = self;
        let first = if bolted { 6 } else { 0 };
        let sum = |slopes: &[Vec<f64>; STAGES], i: usize| {
            weights.iter().zip(slopes).fold(0.0, |sum, (w, slope)| sum + w * slope[i])
        };
        for i in first..at.v.len() {
            at.v[i] = from.v[i] + part * sum(changes, i);
        }
        for i in 0..at.q.len() {
            at.q[i] = from.q[i] + part * sum(rates, 6 + i);
        }
        if !bolted {
            let way = Vec3::new(sum(rates, 0), sum(rates, 1), sum(rates, 2)) * part;
            let turn =
                weights.iter().zip(&*turns).fold(from.base.rotation, |r, (w, turn)| r + *turn * (part * w));
            at.base = Pose::from_parts(from.base.translation + way, turn.normalize());
        }
    }

    /// Difference of the two orders relative to the allowed one.
    fn difference(&self, differences: &[f64], part: f64, bolted: bool) -> f64 {
        let (mut difference, mut scale) = (0.0, 0.0);
        for i in if bolted { 6 } else { 0 }..self.weights.len() {
            let of_orders =
                differences.iter().zip(&self.changes).fold(0.0, |sum, (d, slope)| sum + d * slope[i]);
            let change = part * self.changes[0][i];
            difference += self.weights[i] * (part * of_orders).powi(2);
            scale += self.weights[i] * (self.from.v[i].powi(2) + change * change);
        }
        (difference / (TOLERANCE * TOLERANCE * scale + ROUNDING * ROUNDING)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `Σ wᵢ cᵢᵖ` equals `1/(p + 1)` up to the order of the weights: a method integrates powers of time
    /// exactly.
    fn moment(weights: &[f64], power: i32) -> f64 {
        weights.iter().zip(NODES).map(|(w, c)| w * c.powi(power)).sum()
    }

    #[test]
    fn weights_integrate_powers_up_to_their_order() {
        let fourth: Vec<f64> = WEIGHTS.iter().zip(DIFFERENCES).map(|(w, d)| w - d).collect();
        for (weights, order) in [(&WEIGHTS[..], 5), (&fourth, 4), (&STEADY_WEIGHTS, 2)] {
            for power in 0..order {
                let expected = 1.0 / f64::from(power + 1);
                assert!((moment(weights, power) - expected).abs() < 1e-15, "order {order}, power {power}");
            }
            let beyond = moment(weights, order) - 1.0 / f64::from(order + 1);
            assert!(beyond.abs() > 1e-4, "order {order} is not higher: {beyond:e}");
        }
    }

    #[test]
    fn a_stage_lies_where_its_couplings_lead() {
        for (stage, couplings) in COUPLINGS.iter().enumerate() {
            assert!((couplings.iter().sum::<f64>() - NODES[stage]).abs() < 1e-15, "stage {stage}");
        }
        // The conditions of fifth order with two stages in a row: Σ b a c = 1/6, Σ b a c² = 1/12.
        for (power, expected) in [(1, 1.0 / 6.0), (2, 1.0 / 12.0)] {
            let inner = COUPLINGS.map(|row| moment(&row, power));
            let sum: f64 = WEIGHTS.iter().zip(inner).map(|(b, inner)| b * inner).sum();
            assert!((sum - expected).abs() < 1e-15, "power {power}: {sum}");
        }
    }
}
