//! The libraries' one-line errors as an exception.

use std::fmt::Display;

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;

create_exception!(
    cromosim,
    CromosimError,
    PyValueError,
    "One line that names the file or argument, the place in it and what to do."
);

/// The exception of a library's error.
pub fn raise(error: impl Display) -> PyErr {
    CromosimError::new_err(error.to_string())
}
