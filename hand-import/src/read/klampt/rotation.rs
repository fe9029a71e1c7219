//! Rotations as nine numbers.

use palmares_models::{Mat3, Rotation, Vec3};

/// Columns of a rotation that is given row by row.
pub(crate) fn columns(rows: &[f64]) -> [Vec3; 3] {
    [0, 1, 2].map(|k| Vec3::new(rows[k], rows[3 + k], rows[6 + k]))
}

/// The rotation with these columns, which may have one common length; `None` if they are not orthogonal and right-handed.
pub(crate) fn rotation(columns: [Vec3; 3]) -> Option<Rotation> {
    const EXACT: f64 = 1e-3;
    let size = columns[0].length();
    let [x, y, z] = columns.map(|column| column / size);
    let right = size > 0.0
        && size.is_finite()
        && (x.cross(y) - z).length() < EXACT
        && (y.length() - 1.0).abs() < EXACT
        && x.dot(y).abs() < EXACT;
    // Printed digits are few: the nearest exact axes.
    let x = x.normalize_or_zero();
    let y = (y - x * x.dot(y)).normalize_or_zero();
    right.then(|| Rotation::from_mat3(&Mat3::from_cols(x, y, x.cross(y))))
}
