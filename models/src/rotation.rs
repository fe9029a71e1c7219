//! Rotations in files.

use crate::{Rotation, Vec3};

/// Rotation about fixed axes: roll about x, pitch about y, yaw about z, rad.
pub fn from_rpy([roll, pitch, yaw]: [f64; 3]) -> Rotation {
    let about = |axis: Vec3, angle: f64| {
        let (s, c) = libm::sincos(0.5 * angle);
        Rotation::from_xyzw(s * axis.x, s * axis.y, s * axis.z, c)
    };
    about(Vec3::Z, yaw) * about(Vec3::Y, pitch) * about(Vec3::X, roll)
}
