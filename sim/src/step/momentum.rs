//! Conservation of momentum of a hand with a free base.
//!
//! The momentum at generalized velocity v is `(M v)` of the base's six rows, about the base's origin.

use crate::command::Push;
use crate::dynamics::hand::HandDynamics;
use crate::dynamics::spatial::Force;
use crate::model::Model;
use crate::state::State;
use nalgebra::{Matrix6, Vector6};
use palmares_models::Vec3;

/// Momentum of the hand at generalized velocity `v`.
fn momentum(model: &Model, dynamics: &HandDynamics, v: &[f64]) -> Force {
    let n = model.hand_dofs();
    let row = |k: usize| (0..n).map(|j| dynamics.mass[k * n + j] * v[j]).sum::<f64>();
    Force { force: Vec3::new(row(0), row(1), row(2)), moment: Vec3::new(row(3), row(4), row(5)) }
}

/// First moment of mass m c, kg·m, from the mass matrix' coupling of translation and rotation.
fn first_moment(mass: &[f64], n: usize) -> Vec3 {
    Vec3::new(mass[5 * n + 1], mass[3 * n + 2], mass[4 * n])
}

/// Momentum required at the end of a step that changes `v₀` into `v`, about its base's origin at the start:
/// `M(q₀) v₁ + h c(q₀, v₀)` with the velocity-dependent part of the bias. This is the momentum before plus
/// all external impulses.
pub(super) fn due_after_step(model: &Model, dynamics: &HandDynamics, pushes: &[Push], v: &[f64]) -> Force {
    let (h, gravity) = (model.config().step_s, model.config().gravity);
    let HandDynamics { mass, bias, .. } = dynamics;
    let mut due = momentum(model, dynamics, v);
    due +=
        Force { force: Vec3::new(bias[0], bias[1], bias[2]), moment: Vec3::new(bias[3], bias[4], bias[5]) }
            * h;
    if model.hand().is_some_and(|hand| !hand.gravity_compensation) {
        let first_moment = first_moment(mass, model.hand_dofs());
        due += Force { force: gravity * mass[0], moment: first_moment.cross(gravity) } * h;
    }
    for push in pushes {
        let arm = dynamics.kin.pose[push.link].transform_point(push.point) - dynamics.kin.origin;
        due += Force { force: push.force, moment: arm.cross(push.force) } * h;
    }
    due
}

/// Momentum required after a step of free flight of `state`, about the base's present origin: the centre of
/// mass falls, and the angular momentum about it stays.
pub(super) fn due_after_flight(model: &Model, dynamics: &HandDynamics, state: &State) -> Force {
    let h = model.config().step_s;
    let floats = model.hand().is_some_and(|hand| hand.gravity_compensation);
    let gravity = if floats { Vec3::ZERO } else { model.config().gravity };
    let mass = &dynamics.mass;
    let center = first_moment(mass, model.hand_dofs()) / mass[0];
    let before = momentum(model, dynamics, &state.v);
    let force = before.force + gravity * (mass[0] * h);
    let fallen = center + (before.force + force) * (0.5 * h / mass[0]);
    Force { force, moment: before.moment - center.cross(before.force) + fallen.cross(force) }
}

/// Corrects the hand to the required momentum about `from`, its base's origin before the step: the same
/// velocities have another momentum once the shape has changed. The base takes the difference as if all
/// joints were locked.
pub(super) fn keep(model: &Model, state: &mut State, dynamics: &mut HandDynamics, due: Force, from: Vec3) {
    dynamics.update(model, false, state.base, &state.q, &state.v);
    let now = momentum(model, dynamics, &state.v);
    let due = due.moved(dynamics.kin.origin - from);
    let n = model.hand_dofs();
    let locked = Matrix6::from_fn(|i, j| dynamics.mass[i * n + j]);
    let (force, moment) = (due.force - now.force, due.moment - now.moment);
    let missing = Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
    if let Some(locked) = locked.cholesky() {
        for (v, change) in state.v[..6].iter_mut().zip(locked.solve(&missing).iter()) {
            *v += change;
        }
    }
}
