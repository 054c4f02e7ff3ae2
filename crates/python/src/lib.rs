//! The native half of the Python package `orchardbench`: the environments of `orchard-env` for numpy, and the program `orchard`.
//!
//! The Python half (`python/orchardbench`) puts Gymnasium's interface on it; see `docs/python.md`.

mod arrays;
mod benchmark;
mod buffers;
mod core;
mod guard;
mod tensors;

use pyo3::prelude::*;

/// Runs the program `orchard` on a command line (first word: the program's name) and returns its exit code.
#[pyfunction]
fn run_program(py: Python<'_>, line: Vec<String>) -> PyResult<u8> {
    guard::detached(py, || orchardbench::Failure::finish_code(orchardbench::Program::new().call(line)))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<core::Core>()?;
    module.add_class::<tensors::CudaTensor>()?;
    module.add_function(wrap_pyfunction!(benchmark::run_benchmark, module)?)?;
    module.add_function(wrap_pyfunction!(benchmark::command_log, module)?)?;
    module.add_function(wrap_pyfunction!(run_program, module)?)
}
