//! `palmares.analysis`: hands and grasps in closed form, as arrays.

mod arms;
pub(crate) mod arrays;
mod contacts;
mod design;
mod grasps;
mod hands;

use pyo3::prelude::*;

/// Adds its classes and functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<hands::HandModel>()?;
    module.add_class::<arms::ArmModel>()?;
    module.add("DEFAULT_ARM", palmares_analysis::contact::DEFAULT_ARM)?;
    module.add_function(wrap_pyfunction!(grasps::grasp_matrix, module)?)?;
    module.add_function(wrap_pyfunction!(grasps::contact_stiffness, module)?)?;
    module.add_function(wrap_pyfunction!(grasps::quasistatic, module)?)?;
    module.add_function(wrap_pyfunction!(grasps::soft_synergies, module)?)?;
    module.add_function(wrap_pyfunction!(grasps::form_closure, module)?)?;
    module.add_function(wrap_pyfunction!(grasps::force_closure, module)?)?;
    module.add_function(wrap_pyfunction!(grasps::quality, module)?)?;
    module.add_function(wrap_pyfunction!(grasps::ellipsoid, module)?)?;
    module.add_function(wrap_pyfunction!(grasps::spaces, module)?)
}

pub(crate) use contacts::held;
