//! Ranks, null spaces and pseudo-inverses, by singular values.

use nalgebra::{DMatrix, DVector};

/// Singular values below this part of the largest are zero: four digits above rounding in the matrices of a hand.
pub const RANK_TOLERANCE: f64 = 1e-10;

/// Number of singular values that are not zero.
pub fn rank(matrix: &DMatrix<f64>) -> usize {
    let Some(parts) = decompose(matrix) else { return 0 };
    parts.values.len()
}

/// Orthonormal basis of the vectors x with `A x = 0`, in columns.
pub fn null_space(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.ncols();
    let Some(parts) = decompose(matrix) else { return DMatrix::identity(n, n) };
    complement(&parts.right)
}

/// Orthonormal basis of the vectors `A x`, in columns; the largest first.
pub fn range(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    decompose(matrix).map_or_else(|| DMatrix::zeros(matrix.nrows(), 0), |parts| parts.left)
}

/// The pseudo-inverse A⁺.
pub fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let Some(parts) = decompose(matrix) else { return DMatrix::zeros(matrix.ncols(), matrix.nrows()) };
    let inverse = DVector::from_iterator(parts.values.len(), parts.values.iter().map(|value| 1.0 / value));
    &parts.right * DMatrix::from_diagonal(&inverse) * parts.left.transpose()
}

/// `A = U Σ Vᵀ` without the singular values that are zero.
pub struct Singular {
    /// U, in columns.
    pub left: DMatrix<f64>,
    /// The diagonal of Σ, descending.
    pub values: DVector<f64>,
    /// V, in columns.
    pub right: DMatrix<f64>,
}

/// The singular values of a matrix that are not zero, with their vectors; `None` for a matrix of zeros or without entries.
pub fn decompose(matrix: &DMatrix<f64>) -> Option<Singular> {
    if matrix.is_empty() || matrix.amax() == 0.0 {
        return None;
    }
    let svd = matrix.clone().svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?.transpose());
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
    let largest = svd.singular_values[order[0]];
    order.retain(|i| svd.singular_values[*i] > RANK_TOLERANCE * largest);
    Some(Singular {
        left: u.select_columns(&order),
        values: DVector::from_iterator(order.len(), order.iter().map(|i| svd.singular_values[*i])),
        right: v.select_columns(&order),
    })
}

/// Orthonormal basis of the complement of orthonormal columns.
pub fn complement(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let n = columns.nrows();
    let projector = DMatrix::identity(n, n) - columns * columns.transpose();
    let eigen = projector.symmetric_eigen();
    let keep: Vec<usize> = (0..n).filter(|i| eigen.eigenvalues[*i] > 0.5).collect();
    eigen.eigenvectors.select_columns(&keep)
}

/// Orthonormal basis of the vectors in both of two spaces with orthonormal columns.
pub fn intersection(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let outside_b = a - b * (b.transpose() * a);
    if a.ncols() == 0 {
        return a.clone();
    }
    // Cosines of the angles between the spaces are 1 where the part outside is 0.
    let eigen = (outside_b.transpose() * &outside_b).symmetric_eigen();
    let keep: Vec<usize> = (0..a.ncols()).filter(|i| eigen.eigenvalues[*i] < 1e-16f64.sqrt()).collect();
    a * eigen.eigenvectors.select_columns(&keep)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spaces_of_a_matrix_of_rank_two() {
        let a = DMatrix::from_row_slice(3, 4, &[1.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0, 0.0, 1.0, 3.0, 2.0, 0.0]);
        assert_eq!(rank(&a), 2);
        let null = null_space(&a);
        assert_eq!(null.ncols(), 2);
        assert!((&a * &null).amax() < 1e-14);
        assert!((range(&a).transpose() * range(&a) - DMatrix::identity(2, 2)).amax() < 1e-14);
        let plus = pseudo_inverse(&a);
        assert!((&a * &plus * &a - &a).amax() < 1e-13);
        assert_eq!(rank(&DMatrix::zeros(2, 3)), 0);
        assert_eq!(null_space(&DMatrix::zeros(2, 3)).ncols(), 3);
    }

    #[test]
    fn planes_meet_in_a_line() {
        let plane = |u: [f64; 3], v: [f64; 3]| {
            range(&DMatrix::from_columns(&[DVector::from_row_slice(&u), DVector::from_row_slice(&v)]))
        };
        let line =
            intersection(&plane([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), &plane([1.0, 1.0, 0.0], [0.0, 0.0, 1.0]));
        assert_eq!(line.ncols(), 1);
        assert!((line[0].abs() - 0.5f64.sqrt()).abs() < 1e-12 && (line[0] - line[1]).abs() < 1e-12);
    }
}
