//! `palmares._native`: the engine and the program in a Python process. Users call `palmares.sim`, which has
//! the documentation.
//!
//! The same crates as on a server step it here: same inputs, same bits.
//!
//! `client-py/native/src/analysis/` has the functions of `palmares.analysis`.

mod aligned;
mod analysis;
mod base;
mod batch;
mod batch_step;
mod elementary;
mod fields;
mod history;
mod interrupt;
mod kept;
mod lookup;
mod message;
mod parameters;
mod pictures;
mod pushes;
mod recording;
mod slot;
mod snapshot;
mod state;
mod training;
mod workers;
mod world;

use pyo3::prelude::*;
use std::process::ExitCode;

/// The `palmares` program: returns its exit code. `argv[0]` is its name.
#[pyfunction]
fn main(py: Python<'_>, argv: Vec<String>) -> i32 {
    let code = py.detach(|| palmares::main(argv.into_iter().map(Into::into)));
    // An exit code does not give its number.
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).map_or(1, i32::from)
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<world::PyWorld>()?;
    module.add_class::<snapshot::Snapshot>()?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<recording::Recording>()?;
    analysis::register(module)?;
    elementary::register(module)?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(lookup::welcome, module)?)?;
    module.add_function(wrap_pyfunction!(lookup::faults, module)?)?;
    module.add_function(wrap_pyfunction!(lookup::identity, module)?)?;
    module.add_function(wrap_pyfunction!(lookup::describe_hand, module)?)?;
    module.add_function(wrap_pyfunction!(lookup::objects, module)?)?;
    module.add_function(wrap_pyfunction!(training::hand_numbers, module)?)
}
