//! A run after a tick, as Python holds it.

use crate::history::History;
use palmares_tasks::run;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// A world after a tick. `bytes(snapshot)` is for the same version of the program on any machine; snapshots can be pickled.
#[pyclass(frozen, module = "palmares._native")]
pub(crate) struct Snapshot {
    pub(crate) run: run::Snapshot,
    /// The number of its seed; unknown when it comes from bytes.
    pub(crate) number: Option<u64>,
    /// The actions until then; unknown when it comes from bytes.
    pub(crate) history: Option<History>,
}

#[pymethods]
impl Snapshot {
    /// Reads the result of `bytes(snapshot)`.
    #[new]
    fn new(data: &[u8]) -> PyResult<Self> {
        let run =
            run::Snapshot::from_bytes(data).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(Snapshot { run, number: None, history: None })
    }

    /// The tick after which it was taken.
    #[getter]
    fn tick(&self) -> u64 {
        self.run.tick()
    }

    fn __bytes__<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.run.to_bytes())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (Bound<'py, PyBytes>,)) {
        let bytes = PyBytes::new(slf.py(), &slf.get().run.to_bytes());
        (slf.get_type().into_any(), (bytes,))
    }

    fn __repr__(&self) -> String {
        format!("<Snapshot after tick {}>", self.run.tick())
    }
}
