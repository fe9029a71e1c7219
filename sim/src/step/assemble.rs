//! Assembles an island's minimisation problem: A, A v*, contacts, limits, servo and tendons
//! (see [`crate::solver`] for the problem).

use super::drive::Drive;
use super::slip_correction::{de_saxce, nearness, rest_target};
use super::torque_free::free_turn;
use super::twist_damping;
use crate::actuation::{base, elastic};
use crate::config::Config;
use crate::contact::narrow_phase::{ContactPair, Contacts};
use crate::dynamics::hand::HandDynamics;
use crate::dynamics::pattern::{columns, row_sum};
use crate::model::{Model, Owner};
use crate::solver::friction_cone::{ConeLaw, RollingLaw};
use crate::solver::island::Island;
use crate::solver::problem::{ObjectProblem, PairProblem, Point, Problem};
use crate::solver::terms::{AxisTerm, ScalarLaw};
use crate::state::State;
use palmares_models::Vec3;

/// Stiffness of a rebounding contact per mass of the heavier of its objects: practically rigid.
const REBOUND_STIFFNESS: f64 = 1e6;

/// The same for a contact with e = 0: it keeps a thousandth of its speed.
const DEAD_STIFFNESS: f64 = 1e3;

/// A point that will not meet is this part of its speed below the limit at which it would be braked.
const FREE: f64 = 1e-9;

/// Inputs of an assembled problem.
pub(super) struct Input<'a> {
    pub model: &'a Model,
    pub state: &'a State,
    pub dynamics: &'a HandDynamics,
    pub contacts: &'a Contacts,
    pub drive: &'a Drive,
    /// External force and torque of every object, or empty.
    pub loads: &'a [(Vec3, Vec3)],
}

/// Writes A, A v*, contacts and terms of a step of length `h`, s. `v` becomes the starting point: the present
/// velocities, and for a bolted base the prescribed ones.
pub(super) fn assemble(input: &Input<'_>, island: &Island, h: f64, problem: &mut Problem, v: &mut Vec<f64>) {
    v.clear();
    problem.momentum.clear();
    problem.axis_terms.clear();
    problem.objects.clear();
    problem.hand_dofs = 0;
    problem.bolted = false;
    problem.rows = 0;
    problem.fresh = true;
    if island.hand {
        assemble_hand(input, h, problem, v);
    }
    for &k in &island.objects {
        assemble_object(input, k, h, problem, v);
    }
    assemble_contacts(input, island, problem);
}

fn assemble_hand(input: &Input<'_>, h: f64, problem: &mut Problem, v: &mut Vec<f64>) {
    let Input { model, state, dynamics, drive, .. } = input;
    let Some(hand) = model.hand() else { return };
    let (config, n) = (model.config(), model.hand_dofs());
    problem.hand_dofs = n;
    problem.hand_matrix.clear();
    problem.hand_matrix.extend_from_slice(&dynamics.mass);
    v.extend_from_slice(&state.v[..n]);
    for (block, cluster) in model.clusters()[..model.hand_clusters()].iter().enumerate() {
        let columns = columns(model.clusters(), block, n);
        for i in cluster.dofs.clone() {
            let p = row_sum(&dynamics.mass[i * n..][..n], v, &columns);
            problem.momentum.push(p - h * dynamics.bias[i]);
        }
    }
    problem.bolted = drive.bolted;
    if drive.bolted {
        v[..6].copy_from_slice(&base::way(&state.reference, state.base).map(|way| way / h));
    } else if drive.servo_on {
        base::servo(&config.base, &state.reference, state.base, h, &mut problem.axis_terms);
    }
    for (i, coordinate) in hand.coordinates.iter().enumerate() {
        let k = 6 + i;
        let (e, d) = (coordinate.stiffness, coordinate.damping);
        problem.hand_matrix[k * n + k] += h * (d + h * e);
        problem.momentum[k] -= h * e * (state.q[i] - coordinate.rest);
        let lower = state.q[i] - coordinate.lower;
        let upper = coordinate.upper - state.q[i];
        push_limit(&mut problem.axis_terms, config, h, (k, 1.0), lower, v[k]);
        push_limit(&mut problem.axis_terms, config, h, (k, -1.0), upper, -v[k]);
    }
    let Problem { row_terms, hand_matrix, .. } = problem;
    elastic::terms(hand, state, h, config.step_s, row_terms, |c, k| {
        hand_matrix[(6 + c) * (n + 1)] += h * h * k
    });
    problem.rows = row_terms.len();
}

fn assemble_object(input: &Input<'_>, k: usize, h: f64, problem: &mut Problem, v: &mut Vec<f64>) {
    let Input { model, state, loads, .. } = input;
    let (object, gravity) = (&model.objects()[k], model.config().gravity);
    let (linear, angular) = state.object_velocity(model, k);
    v.extend(linear.to_array());
    v.extend(angular.to_array());
    let rotation = state.objects[k].rotation;
    let inverse = model.object_inertia_inverse(k);
    let (inertia, turn) = free_turn(rotation, angular, object.inertia, inverse, h);
    let carried = turn.map_or(angular, |(_, omega)| omega);
    let (force, torque) = loads.get(k).copied().unwrap_or_default();
    problem.momentum.extend(((linear + gravity * h) * object.mass + force * h).to_array());
    problem.momentum.extend((inertia * carried + torque * h).to_array());
    let center = state.objects[k].translation;
    problem.objects.push(ObjectProblem { object: k, center, mass: object.mass, inertia, turn });
}

/// Laws of the contact points. The step of a contact is always the full one, even if the hand's is shorter
/// (BDF2): a hand in contact is stepped by implicit Euler.
#[inline(never)]
fn assemble_contacts(input: &Input<'_>, island: &Island, problem: &mut Problem) {
    let Input { model, state, dynamics, contacts, .. } = input;
    let config = model.config();
    let (h, tau) = (config.step_s, config.contact_dissipation_s);
    problem.pairs.clear();
    problem.points.clear();
    for &index in &island.pairs {
        let pair = &contacts.pairs[index];
        let first = problem.points.len();
        let (mut load, mut patch) = (0.0, false);
        for point in &contacts.points[pair.points.clone()] {
            let tau = tau.max(point.anchor.struck_s);
            let tangential = h * config.anchor_stiffness * (h + tau);
            let [t1, t2] = point.tangents;
            let axes = [t1, t2, point.normal];
            let (rest, tau_n) = rest_target(config, pair, point);
            let mut pulls_back = point.anchor.stretch / (h + tau);
            if point.anchor.loaded {
                pulls_back += pair.beside / h;
            }
            let target =
                [-pulls_back.dot(t1), -pulls_back.dot(t2), rest - de_saxce(config, pair, point.anchor.slip)];
            let normal = h * config.contact_stiffness * (h + tau_n);
            let law = match point.rebound {
                None => ConeLaw::new(pair.friction, tangential, normal, target),
                Some(rebound) => {
                    let stiff = if pair.restitution > 0.0 { REBOUND_STIFFNESS } else { DEAD_STIFFNESS };
                    let rigid = stiff * heavier(model, pair);
                    let lifted = match rebound.time_s.is_finite() {
                        true => rebound.velocity - pair.friction * rebound.slip + rebound.impulse / rigid,
                        // Nothing else can push a lone body against a surface that it does not meet.
                        false if island.is_lone_object() => f64::NEG_INFINITY,
                        false => {
                            let rounding = FREE * (rebound.velocity.abs() + pair.friction * rebound.slip);
                            rebound.velocity - pair.friction * rebound.slip - rounding
                        }
                    };
                    ConeLaw::new(pair.friction, rigid, rigid, [0.0, 0.0, lifted])
                }
            };
            let flattened = pair.spin.map_or(0.0, |spin| spin.arm(point.anchor.bearing));
            let law = if point.rebound.is_none() && (point.arm > 0.0 || flattened > 0.0) {
                let arm = (point.arm * point.arm + flattened * flattened).sqrt();
                // The points of a patch are held by each other's slip.
                let damped = if flattened > 0.0 {
                    twist_damping::shift((model, state, dynamics), pair, point, (arm, tau))
                } else {
                    0.0
                };
                law.with_spin(arm, -point.anchor.twist / (h + tau) - damped)
            } else {
                law
            };
            load += point.anchor.normal_force;
            patch |= point.friction_r != point.r || law.arm > 0.0;
            problem.points.push(Point::new(point.r, point.friction_r, axes, law));
        }
        let normal = contacts.points[pair.points.start].normal;
        let limit = pair.rolling_friction * load * h;
        let rolling = RollingLaw { limit, deadband: config.rolling_deadband, normal };
        let end = problem.points.len();
        let mut solved = PairProblem::new(pair.a, pair.b, pair.origin, rolling, first, end);
        solved.patch = patch;
        problem.pairs.push(solved);
    }
}

fn push_limit(
    terms: &mut Vec<AxisTerm>,
    config: &Config,
    h: f64,
    (dof, sign): (usize, f64),
    gap: f64,
    rate: f64,
) {
    // Only limits that the step could reach: within 0.05 rad plus the distance at 20 rad/s.
    if gap + h * rate >= 0.05 + 20.0 * h {
        return;
    }
    let tau = h * nearness(gap, config.limit_onset_rad);
    let inverse_regularisation = h * config.limit_stiffness * (h + tau);
    terms.push(AxisTerm {
        dof,
        sign,
        law: ScalarLaw::Limit { inverse_regularisation, target: -gap / (h + tau) },
    });
}

/// Mass of the heavier object of a pair, kg.
fn heavier(model: &Model, pair: &ContactPair) -> f64 {
    let mass = |owner: Owner| match owner {
        Owner::Object(k) => model.objects()[k].mass,
        Owner::Static | Owner::Link(_) => 0.0,
    };
    mass(pair.a).max(mass(pair.b))
}
