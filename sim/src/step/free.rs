//! Motion without contact: ballistic flight, torque-free rotation, and moving coordinates along.

use super::hand_dynamics;
use crate::dynamics::spatial::Force;
use crate::world::World;
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

    /// Momentum that the freely flying hand must have at the end of a step that changes `v₀` into `v`, about its
    /// base's origin at the start: `M(q₀) v₁ + h c(q₀, v₀)` with the velocity-dependent part of the bias, which is
    /// the momentum before plus all impulses from outside.
    pub(super) fn momentum_due(&self, v: &[f64]) -> Force {
        let (h, gravity) = (self.model.config().step_s, self.model.config().gravity);
        let (mass, bias) = (&self.work.mass, &self.work.bias);
        let n = self.model.hand_dofs();
        let mut due = self.hand_momentum(v);
        due += Force {
            force: Vec3::new(bias[0], bias[1], bias[2]),
            moment: Vec3::new(bias[3], bias[4], bias[5]),
        } * h;
        if self.model.hand().is_some_and(|hand| !hand.gravity_compensation) {
            // m c, from the mass matrix' coupling of translation and rotation.
            let first_moment = Vec3::new(mass[5 * n + 1], mass[3 * n + 2], mass[4 * n]);
            due += Force { force: gravity * mass[0], moment: first_moment.cross(gravity) } * h;
        }
        for push in &self.work.pushes {
            let arm = self.work.kin.pose[push.link].transform_point(push.point) - self.work.kin.origin;
            due += Force { force: push.force, moment: arm.cross(push.force) } * h;
        }
        due
    }

    /// Gives the freely flying hand the momentum that is due about `from`, its base's origin before the step: the same
    /// velocities mean another momentum once the shape has changed. The base takes up the difference as if all
    /// joints were locked.
    pub(super) fn keep_momentum(&mut self, due: Force, from: Vec3) {
        hand_dynamics(&self.model, &mut self.work, false, self.state.base, &self.state.q, &self.state.v);
        let now = self.hand_momentum(&self.state.v);
        let due = due.moved(self.work.kin.origin - from);
        let n = self.model.hand_dofs();
        let locked = Matrix6::from_fn(|i, j| self.work.mass[i * n + j]);
        let (force, moment) = (due.force - now.force, due.moment - now.moment);
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
        let (before, mut omega) = self.state.object_velocity(&self.model, object);
        let inverse = self.model.object_inertia_inverse(object);
        let mut after = before + config.gravity * h;
        if let Some((force, torque)) = self.work.loads.get(object) {
            after += *force * (h / self.model.objects()[object].mass);
            omega += omega_at(self.state.objects[object].rotation, inverse, *torque * h);
        }
        let pose = &mut self.state.objects[object];
        let (rotation, angular) =
            torque_free(pose.rotation, omega, self.model.objects()[object].inertia, inverse, h);
        pose.translation += (before + after) * (0.5 * h);
        pose.rotation = rotation;
        let v = &mut self.state.v[at..at + 6];
        v[..3].copy_from_slice(&after.to_array());
        v[3..].copy_from_slice(&angular.to_array());
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

fn is_isotropic(inertia: Mat3) -> bool {
    inertia == Mat3::from_diagonal(Vec3::splat(inertia.x_axis.x))
}

/// Angular velocity `I(R)⁻¹ L` at orientation R.
fn omega_at(rotation: Rotation, inverse: Mat3, momentum: Vec3) -> Vec3 {
    let r = Mat3::from_quat(rotation.normalize());
    r * (inverse * (r.transpose() * momentum))
}

/// Quaternion's derivative at angular velocity ω.
pub(super) fn rate(rotation: Rotation, omega: Vec3) -> Rotation {
    Rotation::from_xyzw(omega.x, omega.y, omega.z, 0.0) * rotation * 0.5
}

/// The largest turn of a substep, rad: beyond it the fourth order means little.
const LARGEST_TURN: f64 = 0.2;

/// ... and so many are enough: what turns twice in a step is turned by larger ones, without its exact orientation but
/// with its angular momentum.
const MOST_PARTS: f64 = 64.0;

/// Turns below this, rad, are exact to rounding by the midpoint method.
const SMALL_TURN: f64 = 1e-4;

/// Where a body comes to without torque: its orientation and angular velocity after h, and its inertia there in
/// world axes. A body whose inertia is a sphere's turns on as it is: `None`.
pub(super) fn free_turn(
    rotation: Rotation,
    omega: Vec3,
    inertia: Mat3,
    inverse: Mat3,
    h: f64,
) -> (Mat3, Option<(Rotation, Vec3)>) {
    if is_isotropic(inertia) {
        return (inertia, None);
    }
    let turn = torque_free(rotation, omega, inertia, inverse, h);
    let r = Mat3::from_quat(turn.0);
    (r * inertia * r.transpose(), Some(turn))
}

/// A rigid body's orientation and angular velocity after h without torque: L is constant, `ω = I(R)⁻¹ L`, by the
/// classical fourth-order Runge–Kutta method on the quaternion.
pub(super) fn torque_free(
    rotation: Rotation,
    omega: Vec3,
    inertia: Mat3,
    inverse: Mat3,
    h: f64,
) -> (Rotation, Vec3) {
    if is_isotropic(inertia) || omega == Vec3::ZERO {
        return (turned(rotation, omega * h), omega);
    }
    let r = Mat3::from_quat(rotation);
    let momentum = r * (inertia * (r.transpose() * omega));
    let slope = |q: Rotation| rate(q, omega_at(q, inverse, momentum));
    let turn = omega.length() * h;
    let mut next = rotation;
    if turn < SMALL_TURN {
        let half = rotation + slope(rotation) * (0.5 * h);
        next = (rotation + slope(half) * h).normalize();
    } else {
        let parts = (turn / LARGEST_TURN).ceil().min(MOST_PARTS);
        let h = h / parts;
        for _ in 0..parts as u32 {
            let k1 = slope(next);
            let k2 = slope(next + k1 * (0.5 * h));
            let k3 = slope(next + k2 * (0.5 * h));
            let k4 = slope(next + k3 * h);
            next = (next + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)).normalize();
        }
    }
    (next, omega_at(next, inverse, momentum))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// It took one part for every 0.2 rad.
    #[test]
    fn an_absurd_spin_takes_no_longer_than_a_fast_one_and_keeps_its_momentum() {
        let inertia = Mat3::from_diagonal(Vec3::new(1.0, 2.0, 3.0));
        let (before, turn) = (Rotation::IDENTITY, Vec3::new(0.3, 0.5, 0.7) * 1e15);
        let (q, w) = torque_free(before, turn, inertia, inertia.inverse(), 1e-3);
        let r = Mat3::from_quat(q);
        let (now, momentum) = (r * inertia * r.transpose() * w, inertia * turn);
        assert!((now - momentum).length() < 1e-9 * momentum.length(), "{now}");
    }

    #[test]
    fn torque_free_rotation_keeps_angular_momentum() {
        let inertia = Mat3::from_diagonal(Vec3::new(1.0, 2.0, 3.0));
        let inverse = inertia.inverse();
        let (mut q, mut w) = (Rotation::IDENTITY, Vec3::new(0.1, 5.0, 0.1));
        let momentum = inertia * w;
        for _ in 0..1000 {
            (q, w) = torque_free(q, w, inertia, inverse, 1e-3);
        }
        let r = Mat3::from_quat(q);
        let now = r * inertia * r.transpose() * w;
        assert!((now - momentum).length() < 1e-9, "{now}");
    }
}
