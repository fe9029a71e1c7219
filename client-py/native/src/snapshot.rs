//! A run after a tick, as Python holds it.

use crate::history::History;
use palmares_tasks::{Seed, run};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// A world after a tick. `bytes(snapshot)` is for the same version of the program on any machine; snapshots can be pickled.
#[pyclass(frozen, module = "palmares._native")]
pub(crate) struct Snapshot {
    pub(crate) run: run::Snapshot,
    /// The seed's number.
    pub(crate) number: u64,
    /// The actions until then; unknown when it comes from bytes.
    pub(crate) history: Option<History>,
}

impl Snapshot {
    /// The seed's number, little-endian, then the run's bytes.
    fn to_bytes(&self) -> Vec<u8> {
        [self.number.to_le_bytes().as_slice(), &self.run.to_bytes()].concat()
    }
}

#[pymethods]
impl Snapshot {
    /// Reads the result of `bytes(snapshot)`.
    #[new]
    fn new(data: &[u8]) -> PyResult<Self> {
        let unreadable = || run::SnapshotError::Unreadable { bytes: data.len() };
        let read = || {
            let (number, rest) = data.split_first_chunk().ok_or_else(unreadable)?;
            let (number, run) = (u64::from_le_bytes(*number), run::Snapshot::from_bytes(rest)?);
            if run.is_of(Seed::from_u64(number)) { Ok((number, run)) } else { Err(unreadable()) }
        };
        let (number, run) =
            read().map_err(|error: run::SnapshotError| PyValueError::new_err(error.to_string()))?;
        Ok(Snapshot { run, number, history: None })
    }

    /// The tick after which it was taken.
    #[getter]
    fn tick(&self) -> u64 {
        self.run.tick()
    }

    /// The seed of its scene.
    #[getter]
    fn seed(&self) -> u64 {
        self.number
    }

    fn __bytes__<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.to_bytes())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (Bound<'py, PyBytes>,)) {
        let bytes = PyBytes::new(slf.py(), &slf.get().to_bytes());
        (slf.get_type().into_any(), (bytes,))
    }

    fn __repr__(&self) -> String {
        format!("<Snapshot of seed {} after tick {}>", self.number, self.run.tick())
    }
}
