//! Pushes on the runs of a batch.

use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use palmares_tasks::Run;
use palmares_tasks::observation::Wrench;
use palmares_tasks::run::PushedPart;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The wrench of each of `count` worlds: forces and torques are arrays (`count`, 3), N and N·m, world frame.
pub(crate) fn wrenches(
    force: &PyReadonlyArray2<'_, f64>,
    torque: &PyReadonlyArray2<'_, f64>,
    count: usize,
) -> PyResult<Vec<Wrench>> {
    for (name, array) in [("force", force), ("torque", torque)] {
        if array.shape() != [count, 3] {
            let message = format!("{name}: found shape {:?}; wanted [{count}, 3]", array.shape());
            return Err(PyValueError::new_err(message));
        }
    }
    let (force, torque) = (force.as_array(), torque.as_array());
    let wrench = |world| Wrench {
        force: [0, 1, 2].map(|axis| force[[world, axis]]),
        torque: [0, 1, 2].map(|axis| torque[[world, axis]]),
    };
    Ok((0..count).map(wrench).collect())
}

/// Pushes a link or an object of runs, each with the number of its world and its own wrench; none if one of them is refused.
pub(crate) fn push(
    mut runs: Vec<(usize, &mut Run, Wrench)>,
    part: PushedPart<'_>,
    duration_s: f64,
) -> PyResult<()> {
    for (world, run, wrench) in &runs {
        let refused = |error| PyValueError::new_err(format!("world {world}: {error}"));
        run.check_push(part, *wrench, duration_s).map_err(refused)?;
    }
    for (world, run, wrench) in &mut runs {
        let refused = |error| PyValueError::new_err(format!("world {world}: {error}"));
        run.push_part(part, *wrench, duration_s).map_err(refused)?;
    }
    Ok(())
}
