//! Matrices, vectors and poses between Rust and numpy, and answers as dictionaries of them.

use nalgebra::{DMatrix, DVector};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use palmares_models::{Pose, Rotation, Vec3};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::fmt::Display;

/// A matrix, or rows of numbers, of Python.
pub(crate) type Matrix<'py> = PyReadonlyArray2<'py, f64>;

/// Position, then quaternion x y z w.
pub(crate) type Seven = [f64; 7];

/// An answer to Python: an array, or a dictionary of a question's arrays and numbers, by [`answer`].
pub(crate) type Answer<'py> = PyResult<Bound<'py, PyAny>>;

/// A part of an answer. Numbers become arrays, indices and texts tuples.
pub(crate) trait Part {
    fn part<'py>(&self, py: Python<'py>) -> Answer<'py>;
}

macro_rules! parts {
    ($($kind:ty: |$py:ident, $it:ident| $made:expr;)*) => {$(
        impl Part for $kind {
            fn part<'py>(&self, $py: Python<'py>) -> Answer<'py> {
                let $it = self;
                $made
            }
        }
    )*};
}

parts! {
    bool: |py, it| it.into_bound_py_any(py);
    usize: |py, it| it.into_bound_py_any(py);
    f64: |py, it| it.into_bound_py_any(py);
    Option<f64>: |py, it| it.into_bound_py_any(py);
    Vec<usize>: |py, it| PyTuple::new(py, it)?.into_bound_py_any(py);
    Vec<String>: |py, it| PyTuple::new(py, it)?.into_bound_py_any(py);
    Vec<f64>: |py, it| PyArray1::from_slice(py, it).into_bound_py_any(py);
    DVector<f64>: |py, it| PyArray1::from_slice(py, it.as_slice()).into_bound_py_any(py);
    DMatrix<f64>: |py, it| shaped(py, it.transpose().as_slice().to_vec(), [it.nrows(), it.ncols()]);
    Option<DMatrix<f64>>: |py, it| it.as_ref().map(|it| it.part(py)).transpose()?.into_bound_py_any(py);
    Pose: |py, it| PyArray1::from_slice(py, &seven(it)).into_bound_py_any(py);
    Vec<Pose>: |py, it| rows(py, it.iter().map(seven));
}

/// A dictionary: fields of a struct by their names, then further entries.
macro_rules! answer {
    ($py:ident $(, $of:ident: {$($field:ident),*})? $(, $name:literal: $value:expr)* $(,)?) => {{
        let dict = pyo3::types::PyDict::new($py);
        $($(dict.set_item(stringify!($field), $of.$field.part($py)?)?;)*)?
        $(dict.set_item($name, $value)?;)*
        Ok(dict.into_any())
    }};
}
pub(super) use answer;

pub(crate) fn value_error(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The value that a word stands for.
pub(crate) fn word<T: Copy>(name: &str, found: &str, words: &[(&str, T)]) -> PyResult<T> {
    words.iter().find(|(word, _)| *word == found).map(|(_, value)| *value).ok_or_else(|| {
        let known: Vec<String> = words.iter().map(|(word, _)| format!("{word:?}")).collect();
        let (last, first) =
            known.split_last().map_or(("", String::new()), |(a, b)| (a.as_str(), b.join(", ")));
        value_error(format!("{name}: found {found:?}; wanted {first} or {last}"))
    })
}

/// The place of a name in a list.
pub(crate) fn place_of(
    name: &str,
    found: &str,
    names: impl Iterator<Item = impl AsRef<str>> + Clone,
) -> PyResult<usize> {
    names.clone().position(|known| known.as_ref() == found).ok_or_else(|| {
        let known: Vec<String> = names.map(|known| known.as_ref().to_owned()).collect();
        value_error(format!("{name}: found {found:?}; wanted one of {}", known.join(", ")))
    })
}

/// Numbers as an array of a shape.
pub(crate) fn shaped<const N: usize>(py: Python<'_>, numbers: Vec<f64>, shape: [usize; N]) -> Answer<'_> {
    PyArray1::from_vec(py, numbers).reshape(shape.to_vec())?.into_bound_py_any(py)
}

/// Rows of equal length as an array.
pub(crate) fn rows<const N: usize>(
    py: Python<'_>,
    rows: impl ExactSizeIterator<Item = [f64; N]>,
) -> Answer<'_> {
    let count = rows.len();
    shaped(py, rows.flatten().collect(), [count, N])
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
