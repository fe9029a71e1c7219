//! A run after a tick, as Python holds it.

use crate::history::History;
use crate::parameters;
use palmares_tasks::training::Given;
use palmares_tasks::{Seed, run};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

/// A world after a tick. `bytes(snapshot)` is for the same version of the program on any machine; snapshots can be pickled.
#[pyclass(frozen, module = "palmares._native")]
pub(crate) struct Snapshot {
    pub(crate) run: run::Snapshot,
    /// The seed's number.
    pub(crate) number: u64,
    /// Numbers that were given rather than drawn.
    pub(crate) given: Given,
    /// The actions until then; unknown when it comes from bytes.
    pub(crate) history: Option<History>,
}

impl Snapshot {
    /// The seed's number and the length of what was given, both in 8 bytes, little-endian; what was given in JSON, nothing where
    /// nothing was; the run's bytes.
    fn to_bytes(&self) -> Vec<u8> {
        let given = if self.given == Given::default() { Vec::new() } else { self.given_json() };
        let length = given.len() as u64;
        [&self.number.to_le_bytes()[..], &length.to_le_bytes(), &given, &self.run.to_bytes()].concat()
    }

    /// Numbers of a `Given` are written so that they are read back bit for bit.
    fn given_json(&self) -> Vec<u8> {
        serde_json::to_vec(&self.given).unwrap_or_default()
    }

    fn from_bytes(data: &[u8]) -> Result<Self, run::SnapshotError> {
        let unreadable = || run::SnapshotError::Unreadable { bytes: data.len() };
        let (number, rest) = data.split_first_chunk().ok_or_else(unreadable)?;
        let (length, rest) = rest.split_first_chunk().ok_or_else(unreadable)?;
        let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| unreadable())?;
        let (given, rest) = rest.split_at_checked(length).ok_or_else(unreadable)?;
        let given = match given {
            [] => Given::default(),
            given => serde_json::from_slice(given).map_err(|_| unreadable())?,
        };
        let (number, run) = (u64::from_le_bytes(*number), run::Snapshot::from_bytes(rest)?);
        let history = None;
        let is_whole = run.is_of(Seed::from_u64(number));
        if is_whole { Ok(Snapshot { run, number, given, history }) } else { Err(unreadable()) }
    }
}

#[pymethods]
impl Snapshot {
    /// Reads the result of `bytes(snapshot)`.
    #[new]
    fn new(data: &[u8]) -> PyResult<Self> {
        Self::from_bytes(data).map_err(|error| PyValueError::new_err(error.to_string()))
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

    /// Numbers that were given rather than drawn, as arrays of one run.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        parameters::given_arrays(py, &self.given)
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
