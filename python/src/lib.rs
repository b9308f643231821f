//! The part of the Python module that is Rust: runs, result files and reports of the library, as arrays and texts. What users
//! see is made of it in `stickslip/*.py`.

mod branches;
mod errors;
mod executor;
mod probe;
mod reports;
mod run;
mod studies;
mod study;
mod waiting;

use pyo3::prelude::*;
use std::collections::HashMap;
use stickslip::record::channel;

/// Of this wheel; `stickslip/_native.pyi` says what there is.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    stickslip::name_build();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    let products = channel::all().filter_map(|channel| Some((channel.name, channel.product?)));
    module.add("PRODUCTS", products.collect::<HashMap<_, _>>())?;
    module.add_class::<run::Run>()?;
    module.add_function(wrap_pyfunction!(run::run, module)?)?;
    module.add_function(wrap_pyfunction!(run::open_result, module)?)?;
    module.add_function(wrap_pyfunction!(run::resolve, module)?)?;
    module.add_function(wrap_pyfunction!(study::is_study, module)?)?;
    module.add_function(wrap_pyfunction!(study::read_study, module)?)?;
    module.add_function(wrap_pyfunction!(branches::is_continuation, module)?)?;
    module.add_function(wrap_pyfunction!(branches::read_continuation, module)?)?;
    module.add_function(wrap_pyfunction!(probe::set_probe, module)?)?;
    module.add_function(wrap_pyfunction!(probe::probe, module)?)?;
    module.add_function(wrap_pyfunction!(executor::evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(studies::sweep, module)?)?;
    module.add_function(wrap_pyfunction!(studies::follow, module)?)?;
    module.add_function(wrap_pyfunction!(reports::certify, module)?)?;
    module.add_function(wrap_pyfunction!(reports::compare, module)?)?;
    module.add_function(wrap_pyfunction!(reports::modes, module)?)?;
    module.add_function(wrap_pyfunction!(reports::cycle, module)?)?;
    module.add_function(wrap_pyfunction!(reports::cases, module)?)?;
    Ok(())
}
