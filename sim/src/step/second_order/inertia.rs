//! Bias forces and inertia in second order.
//!
//! With the mass matrices M₀, M₁ and bias forces c₀, c₁ of both ends of a step, the velocities v of the joints after a step with M₀ and c₀
//! change by δ:
//!
//! `M₀ δ = −½ ((M₁ − M₀) (v₁ − v₀) + h (c₁ − c₀))`
//!
//! The step with c₀ counts `c₀ᵀ Δx` as the change of the potential energy U of weight and pushes. So the hand gains
//!
//! `ε = ΔU − c₀ᵀ Δx + ½ (v + δ)ᵀ M₁ (v + δ) − ½ vᵀ M₀ v − pᵀ v_base`
//!
//! with the impulse p that holds the base against the change. ε is of third order in h. If it is positive, the joints' velocities are
//! reduced until it is 0: fast fingers gain nothing.

use crate::command::Push;
use crate::dynamics::hand::HandDynamics;
use crate::dynamics::pattern::{columns, row_sum};
use crate::dynamics::tree::Kinematics;
use crate::model::Model;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::state::State;
use palmares_models::Vec3;
use palmares_models::hand::Hand;

/// The start of a step, and scratch memory.
#[derive(Default)]
pub(crate) struct Inertia {
    /// Coordinates at the start.
    q: Vec<f64>,
    /// Change of the velocities.
    change: Vec<f64>,
    /// Dynamics at the end.
    end: HandDynamics,
    product: Vec<f64>,
    impulse: Vec<f64>,
}

impl Inertia {
    /// Notes the start of a step whose velocities change by `change`.
    pub(super) fn begin(&mut self, state: &State, change: &[f64]) {
        self.q.clone_from(&state.q);
        self.change.clear();
        self.change.extend_from_slice(change);
    }

    /// Adds half of the change of bias and inertia to the velocities at the end of the step; `dynamics` are those of its start.
    pub(super) fn follow(
        &mut self,
        model: &Model,
        state: &mut State,
        (dynamics, pushes): (&HandDynamics, &[Push]),
        (problem, newton): (&Problem, &mut Newton),
    ) {
        let (h, n) = (model.config().step_s, model.hand_dofs());
        let Some(hand) = model.hand() else { return };
        let Self { q, change, end, product, impulse } = self;
        end.update(model, false, state.base, &state.q, &state.v);
        end.add_pushes(model, pushes);
        product.resize(n, 0.0);
        impulse.resize(n, 0.0);
        times(model, &dynamics.mass, change, impulse);
        times(model, &end.mass, change, product);
        let biases = dynamics.bias.iter().zip(&end.bias);
        for ((impulse, product), (before, after)) in impulse.iter_mut().zip(&*product).zip(biases) {
            *impulse = 0.5 * (*impulse - *product + h * (before - after));
        }
        change.clone_from(impulse);
        newton.solve_held(problem, change);
        let kinetic = |mass: &[f64], v: &[f64], product: &mut [f64]| {
            times(model, mass, v, product);
            0.5 * v.iter().zip(product).map(|(v, p)| v * *p).sum::<f64>()
        };
        let mut gain = -kinetic(&dynamics.mass, &state.v[..n], product);
        gain += potential(model, hand, &end.kin, pushes) - potential(model, hand, &dynamics.kin, pushes);
        let ways =
            state.v[..6].iter().map(|v| h * v).chain(state.q.iter().zip(q).map(|(q, before)| q - *before));
        gain -= ways.zip(&dynamics.bias).map(|(way, bias)| way * bias).sum::<f64>();
        times(model, &dynamics.mass, change, product);
        let held = product[..6].iter().zip(&impulse[..6]).zip(&state.v[..6]);
        gain -= held.map(|((p, impulse), v)| (p - impulse) * v).sum::<f64>();
        state.v.iter_mut().zip(change).for_each(|(v, by)| *v += *by);
        gain += kinetic(&end.mass, &state.v[..n], product);
        let joints: f64 = state.v[6..n].iter().zip(&product[6..]).map(|(v, p)| v * p).sum();
        if gain > 0.0 && joints > 0.0 {
            let keeps = (1.0 - 2.0 * gain / joints).max(0.0).sqrt();
            state.v[6..n].iter_mut().for_each(|v| *v *= keeps);
        }
    }
}

/// Energy of weight and pushes, J.
fn potential(model: &Model, hand: &Hand, kin: &Kinematics, pushes: &[Push]) -> f64 {
    let gravity = if hand.gravity_compensation { Vec3::ZERO } else { model.config().gravity };
    let at = |link: usize, point: Vec3| kin.pose[link].transform_point(point);
    let weight = |(k, link): (usize, &palmares_models::hand::Link)| {
        link.inertia.mass * gravity.dot(at(k, link.inertia.com))
    };
    let pushed = |push: &Push| push.force.dot(at(push.link, push.point));
    -hand.links.iter().enumerate().map(weight).sum::<f64>() - pushes.iter().map(pushed).sum::<f64>()
}

/// `out = M x` with a matrix of the hand's pattern.
pub(super) fn times(model: &Model, matrix: &[f64], x: &[f64], out: &mut [f64]) {
    let n = model.hand_dofs();
    let clusters = &model.clusters()[..model.hand_clusters()];
    for (block, cluster) in clusters.iter().enumerate() {
        let columns = columns(clusters, block, n);
        for i in cluster.dofs.clone() {
            out[i] = row_sum(&matrix[i * n..][..n], x, &columns);
        }
    }
}
