//! `palmares.reproducible`: the engine's elementary functions, with the same bits on every machine.

use pyo3::prelude::*;

/// Functions of one number.
macro_rules! functions {
    ($($name:ident),*) => {
        $(
            #[pyfunction]
            fn $name(x: f64) -> f64 {
                libm::$name(x)
            }
        )*

        /// Adds the functions to the module.
        pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
            $(module.add_function(wrap_pyfunction!($name, module)?)?;)*
            module.add_function(wrap_pyfunction!(atan2, module)?)
        }
    };
}

functions!(sin, cos, tan, asin, acos, exp, log);

#[pyfunction]
fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}
