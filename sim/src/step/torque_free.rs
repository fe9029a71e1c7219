//! Rotation of a rigid body without torque, after Euler's equations: the angular momentum `L = I(R) ω` is constant,
//! `ω = I(R)⁻¹ L`, `q̇ = ½ ω q`.

use palmares_models::{Mat3, Rotation, Vec3};

/// A rotation turned by a rotation vector in the world, rad.
pub(super) fn turned(rotation: Rotation, by: Vec3) -> Rotation {
    (Rotation::from_scaled_axis(by) * rotation).normalize()
}

fn is_isotropic(inertia: Mat3) -> bool {
    inertia == Mat3::from_diagonal(Vec3::splat(inertia.x_axis.x))
}

/// Angular velocity `I(R)⁻¹ L` at orientation R.
pub(super) fn omega_at(rotation: Rotation, inverse: Mat3, momentum: Vec3) -> Vec3 {
    let r = Mat3::from_quat(rotation.normalize());
    r * (inverse * (r.transpose() * momentum))
}

/// Quaternion's derivative at angular velocity ω.
pub(super) fn rate(rotation: Rotation, omega: Vec3) -> Rotation {
    Rotation::from_xyzw(omega.x, omega.y, omega.z, 0.0) * rotation * 0.5
}

/// Largest turn of a substep, rad: its error of the energy is then some 1e-11.
const MAX_TURN: f64 = 0.02;

/// Largest number of substeps: a body that turns twice in a step gets larger substeps, without its exact
/// orientation but with its angular momentum.
const MAX_PARTS: f64 = 64.0;

/// Largest factor by which the energy of a freely turning needle may grow: beyond it its attitude is unknown.
const MAX_GAIN: f64 = 1.01;

/// Smallest [`unlike`] of a needle.
const NEEDLE: f64 = 10.0;

/// Ratio of the moments of an inertia, from it and its inverse: 1 for a ball, 1.1 for a thin disc, 550 for a
/// needle of 1 mm by 60 mm.
pub(super) fn unlike(inertia: Mat3, inverse: Mat3) -> f64 {
    let trace = |matrix: Mat3| matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z;
    trace(inertia) * trace(inverse) / 9.0
}

/// Turn below which the midpoint method is exact to rounding, rad.
const SMALL_TURN: f64 = 1e-4;

/// Orientation and angular velocity of a body after h without torque, and its inertia there in world axes.
/// `None` for a spherical inertia: the body continues to turn as before.
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

/// A rigid body's orientation and angular velocity after h, s, without torque, by the classical fourth-order Runge–Kutta
/// method on the quaternion; L is kept to rounding.
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
        let parts = (turn / MAX_TURN).ceil().min(MAX_PARTS);
        let h = h / parts;
        for _ in 0..parts as u32 {
            let k1 = slope(next);
            let k2 = slope(next + k1 * (0.5 * h));
            let k3 = slope(next + k2 * (0.5 * h));
            let k4 = slope(next + k3 * h);
            next = (next + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)).normalize();
        }
    }
    let after = omega_at(next, inverse, momentum);
    // For a needle that spins about its axis, rounding of its attitude is a large spin: it turns about its
    // present axis instead.
    if after.dot(momentum) > MAX_GAIN * omega.dot(momentum) && unlike(inertia, inverse) > NEEDLE {
        return (turned(rotation, omega * h), omega);
    }
    (next, after)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One part for every 0.2 rad.
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
    fn a_needle_that_spins_about_itself_gains_no_energy() {
        let inertia = Mat3::from_diagonal(Vec3::new(1.5e-7, 1.5e-7, 6e-11));
        for spin in [10.0, 1e3, 5e3, 5e4] {
            let (mut q, mut w) = (Rotation::from_rotation_x(0.3), Vec3::new(60.0, -20.0, 40.0));
            w += q * Vec3::Z * spin;
            let energy = |q: Rotation, w: Vec3| {
                let own = q.inverse() * w;
                own.dot(inertia * own)
            };
            let before = energy(q, w);
            for _ in 0..100 {
                (q, w) = torque_free(q, w, inertia, inertia.inverse(), 1e-2);
            }
            let gain = energy(q, w) / before;
            assert!(gain <= MAX_GAIN.powi(100), "{spin}: {gain}");
        }
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
