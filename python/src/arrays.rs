//! Between vectors of numbers and numpy's arrays.

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods as _};
use pyo3::prelude::*;

/// Numbers row by row as an array that owns them: nothing is copied. `None` where there are none.
pub(crate) fn rows(py: Python<'_>, values: Vec<f64>, columns: usize) -> PyResult<Option<Py<PyArray2<f64>>>> {
    if values.is_empty() || columns == 0 {
        return Ok(None);
    }
    let rows = values.len() / columns;
    Ok(Some(PyArray1::from_vec(py, values).reshape([rows, columns])?.unbind()))
}

/// The same of a single row of them.
pub(crate) fn list<T: Element>(py: Python<'_>, values: Vec<T>) -> Py<PyArray1<T>> {
    PyArray1::from_vec(py, values).unbind()
}
