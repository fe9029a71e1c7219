//! Poses an island's minimisation problem: A, A v*, contacts, limits, servo and tendons.

use super::free::free_turn;
use crate::actuation::{base, tendon};
use crate::config::Config;
use crate::contact::narrow::{ContactPair, ContactPoint};
use crate::dynamics::pattern::{columns, row_sum};
use crate::model::{Model, Owner};
use crate::solver::cone::{ConeLaw, RollingLaw};
use crate::solver::island::Island;
use crate::solver::problem::{ObjectProblem, PairProblem, Point, Problem};
use crate::solver::terms::{AxisTerm, ScalarLaw};
use crate::world::World;

/// A rebounding contact is this much stiffer than the heavier of its objects is heavy: as good as rigid.
const REBOUND_STIFFNESS: f64 = 1e6;

impl World {
    /// Fills in A, A v*, contacts and terms of a step of length h; `v` becomes the starting point, the present
    /// velocities, but those of a bolted base, which are what they must be.
    pub(super) fn pose_problem(&self, island: &Island, problem: &mut Problem, v: &mut Vec<f64>, h: f64) {
        let (model, state, work) = (&self.model, &self.state, &self.work);
        let config = model.config();
        v.clear();
        problem.momentum.clear();
        problem.axis_terms.clear();
        problem.objects.clear();
        problem.hand_dofs = 0;
        problem.held = false;
        problem.rows = 0;
        problem.fresh = true;
        if let (Some(hand), true) = (model.hand(), island.hand) {
            let n = model.hand_dofs();
            problem.hand_dofs = n;
            problem.hand_matrix.clear();
            problem.hand_matrix.extend_from_slice(&work.mass);
            v.extend_from_slice(&state.v[..n]);
            for (block, cluster) in model.clusters()[..model.hand_clusters()].iter().enumerate() {
                let columns = columns(model.clusters(), block, n);
                for i in cluster.dofs.clone() {
                    let p = row_sum(&work.mass[i * n..][..n], v, &columns);
                    problem.momentum.push(p - h * work.bias[i]);
                }
            }
            problem.held = work.held;
            if work.held {
                v[..6].copy_from_slice(&base::way(&state.reference, state.base).map(|way| way / h));
            } else if work.servo_on {
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
            tendon::terms(hand, &state.q, &state.motors, h, &mut problem.row_terms);
            tendon::geometric_stiffness(hand, &state.q, &state.tension, |c, k| {
                problem.hand_matrix[(6 + c) * (n + 1)] += h * h * k;
            });
            problem.rows = hand.tendons.len();
        }
        for &k in &island.objects {
            let object = &model.objects()[k];
            let (linear, angular) = state.object_velocity(model, k);
            v.extend(linear.to_array());
            v.extend(angular.to_array());
            let rotation = state.objects[k].rotation;
            let inverse = model.object_inertia_inverse(k);
            let (inertia, turn) = free_turn(rotation, angular, object.inertia, inverse, h);
            let carried = turn.map_or(angular, |(_, omega)| omega);
            let (force, torque) = work.loads.get(k).copied().unwrap_or_default();
            problem.momentum.extend(((linear + config.gravity * h) * object.mass + force * h).to_array());
            problem.momentum.extend((inertia * carried + torque * h).to_array());
            problem.objects.push(ObjectProblem {
                object: k,
                center: state.objects[k].translation,
                mass: object.mass,
                inertia,
                turn,
            });
        }
        self.pose_contacts(island, problem);
    }

    fn pose_contacts(&self, island: &Island, problem: &mut Problem) {
        let model = &self.model;
        let config = model.config();
        let (h, tau) = (config.step_s, config.contact_dissipation_s);
        problem.pairs.clear();
        problem.points.clear();
        for &index in &island.pairs {
            let pair = &self.work.contacts.pairs[index];
            let first = problem.points.len();
            let mut load = 0.0;
            let found = &self.work.contacts.points[pair.points.clone()];
            let tangential = h * config.anchor_stiffness * (h + tau);
            for point in found {
                let [t1, t2] = point.tangents;
                let axes = [t1, t2, point.normal];
                let (rest, tau_n) = rest_target(config, pair, point);
                let stretch = point.anchor.stretch;
                let target = [
                    -stretch.dot(t1) / (h + tau),
                    -stretch.dot(t2) / (h + tau),
                    rest - glide(config, pair, point.anchor.slip),
                ];
                let normal = h * config.contact_stiffness * (h + tau_n);
                let law = match point.rebound {
                    None => ConeLaw::new(pair.friction, tangential, normal, target),
                    Some(rebound) => {
                        let rigid = REBOUND_STIFFNESS * heavier(model, pair);
                        ConeLaw::new(pair.friction, rigid, rigid, [0.0, 0.0, rebound.velocity])
                    }
                };
                load += point.anchor.normal_force;
                problem.points.push(Point::new(point.r, axes, law));
            }
            let rolling =
                RollingLaw { limit: pair.rolling_friction * load * h, deadband: config.rolling_deadband };
            let end = problem.points.len();
            problem.pairs.push(PairProblem::new(pair.a, pair.b, pair.origin, rolling, first, end));
        }
    }
}

/// Normal velocity at which a contact point that does not slip carries nothing, m/s, and its dissipation time, s.
pub(super) fn rest_target(config: &Config, pair: &ContactPair, point: &ContactPoint) -> (f64, f64) {
    let distance = point.distance + pair.excess;
    let tau_n = config.contact_dissipation_s * nearness(distance, config.contact_onset_m);
    (-distance / (config.step_s + tau_n), tau_n)
}

/// How much lower that velocity is for a point that slips at `slip`, m/s. Convexity makes a sliding contact hover: the
/// de Saxcé term takes that out again.
pub(super) fn glide(config: &Config, pair: &ContactPair, slip: f64) -> f64 {
    pair.friction * (slip - config.glide_deadband).max(0.0)
}

fn push_limit(
    terms: &mut Vec<AxisTerm>,
    config: &Config,
    h: f64,
    (dof, sign): (usize, f64),
    gap: f64,
    rate: f64,
) {
    // Only limits that the step could reach: within 0.05 rad plus what 20 rad/s covers.
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

/// 1 for surfaces that touch, falling to 0 at a gap of `onset`: dissipation sets in without a jump, which would
/// make a contact that is about to close and open again flicker for ever.
fn nearness(gap: f64, onset: f64) -> f64 {
    (1.0 - gap / onset).clamp(0.0, 1.0)
}

/// Mass of the heavier object of a pair, kg.
fn heavier(model: &Model, pair: &ContactPair) -> f64 {
    let mass = |owner: Owner| match owner {
        Owner::Object(k) => model.objects()[k].mass,
        Owner::Static | Owner::Link(_) => 0.0,
    };
    mass(pair.a).max(mass(pair.b))
}
