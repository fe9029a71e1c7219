//! Principal axes of an inertia.

use nalgebra::Matrix3;
use palmares_models::{Mat3, Rotation, Vec3};

/// Principal axes and moments, the largest first.
pub(crate) fn principal(inertia: &Mat3) -> (Rotation, [f64; 3]) {
    let (x, y, z) = (inertia.x_axis, inertia.y_axis, inertia.z_axis);
    let matrix = Matrix3::new(x.x, x.y, x.z, x.y, y.y, y.z, x.z, y.z, z.z);
    let eigen = matrix.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let axis = |k: usize| {
        let v = eigen.eigenvectors.column(order[k]);
        Vec3::new(v[0], v[1], v[2])
    };
    let (first, second) = (axis(0), axis(1));
    let axes = Mat3::from_cols(first, second, first.cross(second));
    (Rotation::from_mat3(&axes), order.map(|k| eigen.eigenvalues[k]))
}
