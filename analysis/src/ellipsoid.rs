//! Manipulability: the ellipsoids of motions and forces that inputs of size 1 cause (Yoshikawa 1985; for compliant hands with
//! synergies, Prattichizzo, Malvezzi, Gabiccini and Bicchi 2012).

use crate::linear::decompose;
use nalgebra::{DMatrix, DVector};

/// The image of the unit ball under a matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Semi-axes, descending; none for directions in which it is flat.
    pub radii: DVector<f64>,
    /// Their unit directions, in columns.
    pub axes: DMatrix<f64>,
    /// Inputs of size 1 that reach their ends, in columns.
    pub inputs: DMatrix<f64>,
    /// Product of the semi-axes: Yoshikawa's measure; 0 if the ellipsoid is flat.
    pub manipulability: f64,
    /// Smallest over largest semi-axis; 0 if the ellipsoid is flat.
    pub isotropy: f64,
}

/// `{A x : ‖x‖ ≤ 1}`
pub fn ellipsoid(matrix: &DMatrix<f64>) -> Ellipsoid {
    let Some(parts) = decompose(matrix) else {
        let (rows, columns) = matrix.shape();
        return Ellipsoid {
            radii: DVector::zeros(0),
            axes: DMatrix::zeros(rows, 0),
            inputs: DMatrix::zeros(columns, 0),
            manipulability: 0.0,
            isotropy: 0.0,
        };
    };
    let full = parts.values.len() == matrix.nrows();
    Ellipsoid {
        manipulability: if full { parts.values.product() } else { 0.0 },
        isotropy: if full { parts.values.min() / parts.values.max() } else { 0.0 },
        radii: parts.values,
        axes: parts.left,
        inputs: parts.right,
    }
}

/// `{f : ‖Aᵀ f‖ ≤ 1}`: the forces that efforts of size 1 hold, where A is the map of velocities. Directions that need no effort
/// are left out: the ellipsoid is infinite there.
pub fn force_ellipsoid(velocities: &DMatrix<f64>) -> Ellipsoid {
    let mut found = ellipsoid(velocities);
    let n = found.radii.len();
    let reversed: Vec<usize> = (0..n).rev().collect();
    found.radii = DVector::from_iterator(n, reversed.iter().map(|&i| 1.0 / found.radii[i]));
    found.axes = found.axes.select_columns(&reversed);
    found.inputs = found.inputs.select_columns(&reversed);
    if found.manipulability > 0.0 {
        found.manipulability = 1.0 / found.manipulability;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two links of length 1 with an angle of 90° between them: `w = l₁ l₂ |sin θ₂| = 1` (Yoshikawa 1985, eq. 26).
    #[test]
    fn a_planar_arm_has_the_manipulability_of_its_elbow() {
        for elbow in [0.5, 1.0, std::f64::consts::FRAC_PI_2] {
            let (s, c) = (elbow.sin(), elbow.cos());
            let j = DMatrix::from_row_slice(2, 2, &[-s, -s, 1.0 + c, c]);
            let velocity = ellipsoid(&j);
            assert!((velocity.manipulability - s).abs() < 1e-14, "{elbow}");
            let force = force_ellipsoid(&j);
            assert!((force.manipulability * velocity.manipulability - 1.0).abs() < 1e-13);
            // The force ellipsoid has the axes of the other, with inverse lengths.
            assert!((force.radii[0] * velocity.radii[1] - 1.0).abs() < 1e-13);
            assert!((force.axes.column(0).dot(&velocity.axes.column(1)).abs() - 1.0).abs() < 1e-13);
        }
        assert_eq!(ellipsoid(&DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 0.0, 0.0])).manipulability, 0.0);
    }
}
