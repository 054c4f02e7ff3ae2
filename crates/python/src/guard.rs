//! Errors and panics as Python exceptions.

use std::any::Any;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

use orchard_env::EnvError;
use orchard_policy::SettingError;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

pyo3::import_exception!(gymnasium.error, ResetNeeded);

/// Computes without the interpreter's lock; a panic becomes a `RuntimeError`.
pub fn detached<T: Send>(py: Python<'_>, compute: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(compute))).map_err(|panic| fault(panic_text(&*panic)))
}

/// Message of a panic.
pub fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
}

/// The exception of a fault of our own.
pub fn fault(text: impl Display) -> PyErr {
    PyRuntimeError::new_err(format!("a fault in OrchardBench, please report it: {text}"))
}

/// The exception of a setting that is refused.
pub fn setting(error: SettingError) -> PyErr {
    exception(error.into())
}

/// The exception of an error: `ResetNeeded` where a reset is missing, `RuntimeError` where a world cannot be built or a graphics device cannot be used, else `ValueError`.
pub fn exception(error: EnvError) -> PyErr {
    let text = error.to_string();
    match error {
        EnvError::NotStarted { .. } | EnvError::Ended { .. } => ResetNeeded::new_err(text),
        EnvError::World { .. } | EnvError::NoTarget { .. } | EnvError::Device(_) => {
            PyRuntimeError::new_err(text)
        }
        _ => PyValueError::new_err(text),
    }
}
