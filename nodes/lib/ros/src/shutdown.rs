//! The end of the process: SIGINT, SIGTERM or the program's own request.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, Weak};
use std::time::Duration;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::error::{RosError, RosResult};
use crate::wake::{Bell, lock};

/// After the first signal. As long as launch waits before it sends SIGTERM.
const REPEATS_IGNORED: Duration = Duration::from_secs(5);

/// A request to end, seen by every loop that sleeps on a [`Bell`] of this crate.
///
/// Cloning shares the request.
#[derive(Clone, Debug, Default)]
pub struct Shutdown {
    inner: Arc<Inner>,
}

#[derive(Debug, Default)]
struct Inner {
    requested: AtomicBool,
    bells: Mutex<Vec<Weak<Bell>>>,
}

impl Shutdown {
    /// A request that only [`Shutdown::request`] makes.
    pub fn new() -> Self {
        Self::default()
    }

    /// The process's own request, made by the first SIGINT or SIGTERM. Further ones end the process
    /// at once, but within five seconds they are ignored: a terminal and a launcher both send
    /// theirs, and files have to be closed.
    ///
    /// # Errors
    /// Where the system refuses signal handlers.
    pub fn on_signals() -> RosResult<Self> {
        static INSTALLED: OnceLock<Result<Shutdown, String>> = OnceLock::new();
        INSTALLED
            .get_or_init(|| install().map_err(|error| error.to_string()))
            .clone()
            .map_err(|problem| RosError::Argument {
                place: "signal handlers".into(),
                problem,
            })
    }

    /// The request is made when standard input ends: with the process that holds its other end,
    /// however that one ends.
    ///
    /// # Errors
    /// Where the system refuses a thread.
    pub(crate) fn request_at_end_of_input(&self) -> RosResult<()> {
        let requester = self.clone();
        let watch = move || {
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            log::info!("standard input has ended: ending");
            requester.request();
        };
        let thread = std::thread::Builder::new().name("stdin".into());
        thread
            .spawn(watch)
            .map(drop)
            .map_err(|error| RosError::Argument {
                place: "--end-with-stdin".into(),
                problem: error.to_string(),
            })
    }

    /// Asks every loop to end.
    pub fn request(&self) {
        self.inner.requested.store(true, Ordering::SeqCst);
        for bell in lock(&self.inner.bells).iter().filter_map(Weak::upgrade) {
            bell.ring();
        }
    }

    /// True from the request on.
    pub fn is_requested(&self) -> bool {
        self.inner.requested.load(Ordering::SeqCst)
    }

    /// Rings `bell` at the request, or at once where it was made already.
    pub fn ring_at_request(&self, bell: &Arc<Bell>) {
        let mut bells = lock(&self.inner.bells);
        bells.retain(|bell| bell.strong_count() > 0);
        bells.push(Arc::downgrade(bell));
        drop(bells);
        if self.is_requested() {
            bell.ring();
        }
    }

    /// Sleeps until the request.
    pub fn wait(&self) {
        let bell = Bell::new();
        self.ring_at_request(&bell);
        while !self.is_requested() {
            bell.wait(None);
        }
    }
}

fn install() -> std::io::Result<Shutdown> {
    let shutdown = Shutdown::new();
    let next_ends = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register_conditional_default(signal, Arc::clone(&next_ends))?;
    }
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    let requester = shutdown.clone();
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || {
            if let Some(signal) = signals.forever().next() {
                log::info!(
                    "{}: ending",
                    if signal == SIGINT {
                        "SIGINT"
                    } else {
                        "SIGTERM"
                    }
                );
                requester.request();
                std::thread::sleep(REPEATS_IGNORED);
                next_ends.store(true, Ordering::SeqCst);
            }
        })?;
    Ok(shutdown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_rings_bells_registered_before_and_after() {
        let shutdown = Shutdown::new();
        let before = Bell::new();
        shutdown.ring_at_request(&before);
        assert!(!shutdown.is_requested());
        shutdown.request();
        let after = Bell::new();
        shutdown.ring_at_request(&after);
        assert!(before.wait(Some(std::time::Duration::ZERO)));
        assert!(after.wait(Some(std::time::Duration::ZERO)));
        shutdown.wait();
    }
}
