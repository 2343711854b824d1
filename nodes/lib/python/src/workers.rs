//! Work on all cores, also in processes that were forked.

use std::mem;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::raise;

/// The threads that work, and the process that has them.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Does `work` with the interpreter's lock released; what it does in parallel runs in this process' own
/// pool, of `RAYON_NUM_THREADS` threads or one for each core.
///
/// # Errors
/// Of `work`, and where no threads can be started.
pub fn on_all_cores<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> PyResult<T> + Send,
) -> PyResult<T> {
    let pool = own_pool(py)?;
    py.detach(|| pool.install(work))
}

/// A forked process, as `torch`'s data loaders and `multiprocessing` make them, has its parent's pool
/// without its threads, and would wait for them for ever: it makes its own.
fn own_pool(_: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    // Whoever forks holds the interpreter's lock, as whoever comes here does: no child finds this one locked.
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((process, pool)) = &*pool
        && *process == process::id()
    {
        return Ok(pool.clone());
    }
    let own = Arc::new(ThreadPoolBuilder::new().build().map_err(raise)?);
    // Dropping the parent's would wake threads that are not there.
    mem::forget(pool.replace((process::id(), own.clone())));
    Ok(own)
}
