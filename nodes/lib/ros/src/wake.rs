//! What threads sleep on.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Wake, Waker};
use std::time::{Duration, Instant};

/// A bell: rung by arriving messages, by a shutdown, or by hand; a thread sleeps until it rings.
/// Rings before the wait are not lost.
#[derive(Debug, Default)]
pub struct Bell {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    rung: bool,
    waiting: usize,
}

impl Bell {
    /// A bell that has not rung.
    pub fn new() -> Arc<Self> {
        Arc::new(Self::default())
    }

    /// Wakes the thread that waits, or the next one that will.
    pub fn ring(&self) {
        self.ring_and_ask();
    }

    /// Rings, and tells whether a thread was waiting.
    pub(crate) fn ring_and_ask(&self) -> bool {
        let mut state = lock(&self.state);
        state.rung = true;
        let waiting = state.waiting > 0;
        drop(state);
        self.changed.notify_all();
        waiting
    }

    /// Sleeps until the bell rings or `timeout` (none: for ever) is over. True where it rang.
    pub fn wait(&self, timeout: Option<Duration>) -> bool {
        self.wait_until(timeout.map(|timeout| Instant::now() + timeout))
    }

    /// Sleeps until the bell rings or `deadline` (none: for ever) is past. True where it rang.
    pub fn wait_until(&self, deadline: Option<Instant>) -> bool {
        let mut state = lock(&self.state);
        state.waiting += 1;
        while !state.rung {
            match deadline.map(|deadline| deadline.saturating_duration_since(Instant::now())) {
                None => {
                    state = self
                        .changed
                        .wait(state)
                        .unwrap_or_else(PoisonError::into_inner)
                }
                Some(Duration::ZERO) => break,
                Some(left) => {
                    state = self
                        .changed
                        .wait_timeout(state, left)
                        .unwrap_or_else(PoisonError::into_inner)
                        .0
                }
            }
        }
        state.waiting -= 1;
        std::mem::take(&mut state.rung)
    }

    pub(crate) fn waker(self: &Arc<Self>) -> Waker {
        Waker::from(Arc::clone(self))
    }
}

impl Wake for Bell {
    fn wake(self: Arc<Self>) {
        self.ring();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.ring();
    }
}

/// Locks also what a panicking thread left behind: nothing here is left half-changed.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_before_the_wait_is_kept_and_used_up_once() {
        let bell = Bell::new();
        bell.ring();
        bell.ring();
        assert!(bell.wait(Some(Duration::ZERO)));
        assert!(!bell.wait(Some(Duration::ZERO)));
    }

    #[test]
    fn a_ring_from_another_thread_ends_the_wait() {
        let bell = Bell::new();
        let ringer = std::thread::spawn({
            let bell = Arc::clone(&bell);
            move || bell.waker().wake()
        });
        assert!(bell.wait(None));
        assert!(ringer.join().is_ok());
    }
}
