//! The extension module behind the Python package `leeward`: the crates' functions as they are,
//! arrays through numpy, everything nested as JSON text. `src/leeward` gives it names and types.
//!
//! `waiting` runs work that takes long so that Ctrl-C reaches it; `refused` makes the package's
//! exceptions, whose fields say what is wrong and where. Then one file a subject.

mod air;
mod exports;
mod fleet;
mod recordings;
mod refused;
mod running;
mod waiting;

use pyo3::prelude::*;

/// What `leeward` is made of; import `leeward`, not this.
#[pymodule]
fn _leeward(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("PRESETS", airflow::Airframe::PRESETS.to_vec())?;
    module.add_class::<air::Air>()?;
    module.add_class::<air::Separation>()?;
    module.add_class::<fleet::World>()?;
    module.add_class::<fleet::Plan>()?;
    module.add_class::<recordings::Recording>()?;
    module.add_class::<running::Running>()?;
    module.add_function(wrap_pyfunction!(fleet::plan, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::check, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::fly, module)?)?;
    module.add_function(wrap_pyfunction!(exports::export, module)?)?;
    module.add_function(wrap_pyfunction!(exports::written_by_another, module)?)?;
    module.add_function(wrap_pyfunction!(recordings::read_all, module)?)?;
    module.add_function(wrap_pyfunction!(recordings::no_force, module)?)?;
    module.add_function(wrap_pyfunction!(recordings::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(recordings::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(recordings::diagnose_flights, module)?)?;
    module.add_function(wrap_pyfunction!(recordings::calibrate, module)?)?;
    Ok(())
}
