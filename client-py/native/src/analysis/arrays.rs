//! Matrices, vectors and poses between Rust and numpy.

use nalgebra::{DMatrix, DVector};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use palmares_models::{Pose, Rotation, Vec3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::fmt::Display;

/// A matrix, or rows of numbers, of Python.
pub(crate) type Matrix<'py> = PyReadonlyArray2<'py, f64>;

/// Position, then quaternion x y z w.
pub(crate) type Seven = [f64; 7];

pub(crate) fn value_error(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A matrix as an array.
pub(crate) fn array<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows: Vec<f64> = matrix.transpose().as_slice().to_vec();
    PyArray1::from_vec(py, rows).reshape([matrix.nrows(), matrix.ncols()])
}

/// A vector as an array.
pub(crate) fn vector<'py>(py: Python<'py>, values: &DVector<f64>) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, values.as_slice())
}

/// Rows of equal length as an array.
pub(crate) fn rows<'py, const N: usize>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = [f64; N]>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.flatten().collect()).reshape([count, N])
}

/// An array as a matrix; every number must be finite.
pub(crate) fn matrix(name: &str, array: &Matrix<'_>) -> PyResult<DMatrix<f64>> {
    let view = array.as_array();
    if view.iter().any(|x| !x.is_finite()) {
        return Err(value_error(format!("{name}: every number must be finite")));
    }
    let (rows, columns) = view.dim();
    Ok(DMatrix::from_row_iterator(rows, columns, view.iter().copied()))
}

/// A pose; the quaternion is normalised.
pub(crate) fn pose(name: &str, numbers: Seven) -> PyResult<Pose> {
    let [x, y, z, a, b, c, d] = numbers;
    let turn = Rotation::from_xyzw(a, b, c, d);
    if numbers.iter().any(|x| !x.is_finite()) || turn.length() < 1e-9 {
        return Err(value_error(format!(
            "{name}: found {numbers:?}; wanted a position and a quaternion x y z w"
        )));
    }
    Ok(Pose::from_parts(Vec3::new(x, y, z), turn.normalize()))
}

pub(crate) fn seven(pose: &Pose) -> Seven {
    let ([x, y, z], [a, b, c, d]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, a, b, c, d]
}

/// Checks the length of a list of finite numbers.
pub(crate) fn numbers(name: &str, values: &[f64], wanted: usize) -> PyResult<()> {
    if values.len() == wanted && values.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(value_error(format!("{name}: found {values:?}; wanted {wanted} finite numbers")))
}
