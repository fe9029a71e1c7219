//! Motion without contact: ballistic flight, torque-free rotation, and moving coordinates along.

use super::hand_dynamics;
use crate::dynamics::spatial::Force;
use crate::world::{FreeTurn, World};
use nalgebra::{Matrix6, Vector6};
use palmares_models::{Mat3, Pose, Rotation, Vec3};

impl World {
    /// Momentum of the hand about its base's present origin at generalized velocity `v`, with the mass matrix of the
    /// workspace: `(M v)` of the base's six rows.
    pub(super) fn hand_momentum(&self, v: &[f64]) -> Force {
        let n = self.model.hand_dofs();
        let row = |k: usize| (0..n).map(|j| self.work.mass[k * n + j] * v[j]).sum::<f64>();
        Force { force: Vec3::new(row(0), row(1), row(2)), moment: Vec3::new(row(3), row(4), row(5)) }
    }

    /// Gives the freely flying hand the momentum it had before its shape changed: `M(q₀) v₁` was solved for, but
    /// at q₁ the same velocities mean another momentum. The base takes up the difference as if all joints were
    /// locked. `momentum` is about the base's origin before the step.
    pub(super) fn keep_momentum(&mut self, momentum: Force) {
        let from = self.work.kin.origin;
        hand_dynamics(&self.model, &mut self.work, self.state.base, &self.state.q, &self.state.v);
        let now = self.hand_momentum(&self.state.v);
        let momentum = momentum.moved(self.work.kin.origin - from);
        let n = self.model.hand_dofs();
        let locked = Matrix6::from_fn(|i, j| self.work.mass[i * n + j]);
        let (force, moment) = (momentum.force - now.force, momentum.moment - now.moment);
        let missing = Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
        if let Some(locked) = locked.cholesky() {
            for (v, change) in self.state.v[..6].iter_mut().zip(locked.solve(&missing).iter()) {
                *v += change;
            }
        }
    }

    /// Exact ballistic motion of an object that touches nothing.
    pub(super) fn fly(&mut self, object: usize) {
        let config = self.model.config();
        let (h, at) = (config.step_s, self.model.object_dofs(object));
        let v = &mut self.state.v[at..at + 6];
        let before = Vec3::new(v[0], v[1], v[2]);
        let after = before + config.gravity * h;
        let turn = &self.work.free_turn[object];
        v[..3].copy_from_slice(&after.to_array());
        v[3..].copy_from_slice(&turn.angular.to_array());
        let pose = &mut self.state.objects[object];
        pose.translation += (before + after) * (0.5 * h);
        pose.rotation = turn.rotation;
    }
}

/// Moves coordinates by `v · time`; returns where the base comes to.
pub(super) fn advanced(base: Pose, q: &mut [f64], v: &[f64], time: f64) -> Pose {
    for (q, rate) in q.iter_mut().zip(&v[6..]) {
        *q += time * rate;
    }
    let (linear, angular) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]));
    Pose::from_parts(base.translation + linear * time, turned(base.rotation, angular * time))
}

pub(super) fn turned(rotation: Rotation, by: Vec3) -> Rotation {
    (Rotation::from_scaled_axis(by) * rotation).normalize()
}

/// A rigid body's rotation over h without torque: L is constant, `ω = I(R)⁻¹ L`, by one step of the classical
/// fourth-order Runge–Kutta method on the quaternion.
pub(super) fn torque_free(rotation: Rotation, omega: Vec3, inertia: Mat3, inverse: Mat3, h: f64) -> FreeTurn {
    let isotropic = inertia == Mat3::from_diagonal(Vec3::splat(inertia.x_axis.x));
    let r = Mat3::from_quat(rotation);
    let world = if isotropic { inertia } else { r * inertia * r.transpose() };
    if isotropic || omega == Vec3::ZERO {
        return FreeTurn { inertia: world, rotation: turned(rotation, omega * h), angular: omega };
    }
    let momentum = world * omega;
    let omega_at = |q: Rotation| {
        let r = Mat3::from_quat(q.normalize());
        r * (inverse * (r.transpose() * momentum))
    };
    let rate = |q: Rotation| {
        let w = omega_at(q);
        Rotation::from_xyzw(w.x, w.y, w.z, 0.0) * q * 0.5
    };
    let k1 = rate(rotation);
    let k2 = rate(rotation + k1 * (0.5 * h));
    let k3 = rate(rotation + k2 * (0.5 * h));
    let k4 = rate(rotation + k3 * h);
    let next = (rotation + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)).normalize();
    FreeTurn { inertia: world, rotation: next, angular: omega_at(next) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_free_rotation_keeps_angular_momentum() {
        let inertia = Mat3::from_diagonal(Vec3::new(1.0, 2.0, 3.0));
        let inverse = inertia.inverse();
        let (mut q, mut w) = (Rotation::IDENTITY, Vec3::new(0.1, 5.0, 0.1));
        let momentum = inertia * w;
        for _ in 0..1000 {
            let turn = torque_free(q, w, inertia, inverse, 1e-3);
            (q, w) = (turn.rotation, turn.angular);
        }
        let r = Mat3::from_quat(q);
        let now = r * inertia * r.transpose() * w;
        assert!((now - momentum).length() < 1e-9, "{now}");
    }
}
