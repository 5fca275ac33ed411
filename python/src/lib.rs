//! The Python package `twinalign`: sessions as arrays, identification and diagnosis, the twin step by
//! step, tasks in which policies act. What everything means is
//! written where Python looks for it: in `twinalign/__init__.pyi` and in the docstrings.

mod arrays;
mod explain;
mod session;
mod task;
mod twin;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::fmt::Display;

/// An error as Python has it: one line with a remedy.
fn failed(error: impl Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

#[pymodule]
mod _twinalign {
    #[pymodule_export]
    use super::explain::{diagnose, effects, identify_arm, identify_object};
    #[pymodule_export]
    use super::session::{Clip, Session};
    #[pymodule_export]
    use super::task::TaskEpisode;
    #[pymodule_export]
    use super::twin::Twin;
}
