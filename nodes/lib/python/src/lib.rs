//! The compiled half of the Python package `cromosim`: it turns NumPy arrays into the libraries'
//! types and back. What people call, and its documentation, is in `python/cromosim`.
//!
//! Without the feature `python` this crate is empty, so that the workspace builds and passes its
//! tests where there is no Python.
#![cfg(feature = "python")]

mod arrays;
mod body;
mod device;
mod diagnosis;
mod error;
mod motion;
mod rigid;
mod simulate;
mod workers;

use pyo3::prelude::*;

/// What `cromosim._native` holds.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::body::Body;
    #[pymodule_export]
    use super::device::{apply_device, check_device, effects};
    #[pymodule_export]
    use super::diagnosis::{Record, diagnose, read_records};
    #[pymodule_export]
    use super::error::CromosimError;
    #[pymodule_export]
    use super::motion::{Motion, read_motion, walk};
    #[pymodule_export]
    use super::rigid::{Stream, simulate_rigid};
    #[pymodule_export]
    use super::simulate::simulate;

    use super::{Bound, PyModule, PyModuleMethods, PyResult};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

// Fits work in some megabytes that are made anew in each thread. This allocator asks for them as huge pages, which
// the C library's does only where a variable of the environment says so, and begins them at a cache line: a first
// call waits for less memory, and all read it faster.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;
