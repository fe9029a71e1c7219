//! An arm that carries a hand: where its base is, and where the joints must be.

use super::arrays::{Answer, Part, Seven, answer, numbers, pose, rows, seven, value_error};
use crate::lookup;
use palmares_models::arm::Arm;
use palmares_sim::arm::place;
use pyo3::prelude::*;
use std::sync::Arc;

/// The arm of a task.
#[pyclass(module = "palmares._native", frozen)]
pub(crate) struct ArmModel {
    arm: Arc<Arm>,
    start: Vec<f64>,
}

#[pymethods]
impl ArmModel {
    #[new]
    fn new(task: &str) -> PyResult<Self> {
        let task = lookup::task(task)?;
        let Some(carrier) = &task.arm else {
            return Err(value_error(format!("task {:?} has no arm: its hand flies freely", task.name)));
        };
        Ok(ArmModel { arm: Arc::clone(carrier.arm()), start: carrier.guess() })
    }

    #[getter]
    fn joints(&self) -> Vec<&str> {
        self.arm.joints.iter().map(|joint| joint.name.as_str()).collect()
    }

    #[getter]
    fn start(&self) -> Vec<f64> {
        self.start.clone()
    }

    /// Least and largest position and largest speed of each joint: n × 3.
    fn limits<'py>(&self, py: Python<'py>) -> Answer<'py> {
        rows(py, self.arm.joints.iter().map(|joint| [joint.lower, joint.upper, joint.speed]))
    }

    fn base(&self, q: Vec<f64>) -> PyResult<Seven> {
        numbers("q", &q, self.arm.joints.len())?;
        Ok(seven(&self.arm.base_at(&q)))
    }

    /// Columns of the Jacobian: n × 6.
    fn jacobian<'py>(&self, py: Python<'py>, q: Vec<f64>) -> Answer<'py> {
        numbers("q", &q, self.arm.joints.len())?;
        let columns = self.arm.jacobian(&q).into_iter();
        rows(py, columns.map(|(v, w)| [v.x, v.y, v.z, w.x, w.y, w.z]))
    }

    /// Joints for a pose of the base, and how far it then is from it, m and rad.
    fn inverse<'py>(&self, py: Python<'py>, base: Seven, start: Vec<f64>) -> Answer<'py> {
        numbers("start", &start, self.arm.joints.len())?;
        let found = place(&self.arm, &start, pose("base", base)?);
        answer!(py, found: {q, gap_m, gap_rad})
    }
}
