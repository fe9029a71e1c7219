//! Rows of the problem.

use crate::solver::terms::{RowTerm, ScalarLaw};

/// A row of joints that has no law yet.
pub(super) fn row(arms: &[(usize, f64)]) -> RowTerm {
    let row = arms.iter().map(|&(coordinate, arm)| (6 + coordinate, arm)).collect();
    RowTerm { row, law: ScalarLaw::Limit { inverse_regularisation: 0.0, target: 0.0 } }
}
