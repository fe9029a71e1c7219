//! Arrays whose numbers begin at a multiple of 64 bytes: jax takes only such ones without a copy.

use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PySlice;

/// Bytes of the grid on which the numbers begin.
const GRID: usize = 64;

/// Numbers for an array.
pub(crate) struct Aligned<T> {
    all: Vec<T>,
    first: usize,
    len: usize,
}

impl<T: Element + Copy + Default> Default for Aligned<T> {
    fn default() -> Self {
        Aligned::zeros(0)
    }
}

impl<T: Element + Copy + Default> Aligned<T> {
    /// So many zeros.
    pub(crate) fn zeros(len: usize) -> Self {
        let all = vec![T::default(); len + GRID / size_of::<T>()];
        // A vector's memory does not move while it has its length.
        let first = all.as_ptr().align_offset(GRID).min(all.len() - len);
        Aligned { all, first, len }
    }

    /// A copy of these numbers.
    pub(crate) fn of(numbers: &[T]) -> Self {
        let mut made = Self::zeros(numbers.len());
        made.numbers().copy_from_slice(numbers);
        made
    }

    /// The numbers.
    pub(crate) fn numbers(&mut self) -> &mut [T] {
        &mut self.all[self.first..self.first + self.len]
    }

    /// The array, which takes the memory over.
    pub(crate) fn array<'py>(self, py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
        let [first, end] = [self.first, self.first + self.len].map(|place| place as isize);
        let all = PyArray1::from_vec(py, self.all);
        let part = all.call_method1("__getitem__", (PySlice::new(py, first, end, 1),))?;
        Ok(part.cast_into::<PyArray1<T>>()?.reshape(shape.to_vec())?.into_any())
    }
}
