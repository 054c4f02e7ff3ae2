//! Errors and panics as Python exceptions.

use std::panic::{AssertUnwindSafe, catch_unwind};

use orchard_env::EnvError;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

pyo3::import_exception!(gymnasium.error, ResetNeeded);

/// Computes without the interpreter's lock; a panic becomes a `RuntimeError`.
pub fn detached<T: Send>(py: Python<'_>, compute: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(compute))).map_err(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
        PyRuntimeError::new_err(format!("a fault in OrchardBench, please report it: {text}"))
    })
}

/// The exception of an error: `ResetNeeded` where a reset is missing, `RuntimeError` where a world cannot be built, else `ValueError`.
pub fn exception(error: EnvError) -> PyErr {
    let text = error.to_string();
    match error {
        EnvError::NotStarted { .. } | EnvError::Ended { .. } => ResetNeeded::new_err(text),
        EnvError::World { .. } | EnvError::NoTarget { .. } => PyRuntimeError::new_err(text),
        _ => PyValueError::new_err(text),
    }
}
