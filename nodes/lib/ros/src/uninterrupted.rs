//! Waits that signals do not end.
//!
//! RustDDS 0.15.1 takes an interrupted `epoll_wait` for an error (EINTR) and ends the thread, for
//! good and with no more than a line in the log: the node hears and says nothing more, and to make
//! a publisher locks up. A process that is stopped and continued (Ctrl-Z and `fg`) comes to that, one
//! that is told to end twice, and one whose child ends while it starts another (SIGCHLD is not
//! ignored while `posix_spawn` blocks it). Signals can be kept from a thread, a stop cannot. So this
//! crate stands in for the C library's `epoll_wait`, as it does for `bind`: an interrupted wait goes
//! on until its time is over.

use std::io;
use std::time::{Duration, Instant};

use libc::{c_int, epoll_event};

/// The C library's `epoll_wait` for the whole program: the linker takes this one.
///
/// # Safety
/// As the C library's: `events` has room for `most` of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn epoll_wait(
    queue: c_int,
    events: *mut epoll_event,
    most: c_int,
    timeout_ms: c_int,
) -> c_int {
    let deadline = u64::try_from(timeout_ms)
        .ok()
        .map(|timeout| Instant::now() + Duration::from_millis(timeout));
    let mut left_ms = timeout_ms;
    loop {
        // SAFETY: as this function's; without a mask of signals the last two count for nothing.
        let found = unsafe {
            libc::syscall(
                libc::SYS_epoll_pwait,
                queue,
                events,
                most,
                left_ms,
                std::ptr::null::<libc::sigset_t>(),
                0_usize,
            )
        };
        if found >= 0 || io::Error::last_os_error().kind() != io::ErrorKind::Interrupted {
            return found as c_int;
        }
        left_ms = deadline.map_or(timeout_ms, left);
    }
}

/// Milliseconds until then, rounded up as timers are.
fn left(deadline: Instant) -> c_int {
    let left = deadline.saturating_duration_since(Instant::now());
    left.as_nanos()
        .div_ceil(1_000_000)
        .try_into()
        .unwrap_or(c_int::MAX)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
    use std::os::unix::thread::JoinHandleExt;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    #[test]
    fn a_wait_goes_on_after_a_signal_until_its_time_is_over() {
        let signalled = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register(signal_hook::consts::SIGUSR2, Arc::clone(&signalled)).unwrap();
        let waiting = std::thread::spawn(|| {
            // SAFETY: a new descriptor, which nobody else owns.
            let queue = unsafe { OwnedFd::from_raw_fd(libc::epoll_create1(0)) };
            let mut events = [epoll_event { events: 0, u64: 0 }; 4];
            let begun = Instant::now();
            // SAFETY: there is room for four; the C library's name, as others call it.
            let found = unsafe { libc::epoll_wait(queue.as_raw_fd(), events.as_mut_ptr(), 4, 600) };
            (found, begun.elapsed())
        });
        // Nothing tells when the thread sleeps: it is woken again and again.
        while !waiting.is_finished() {
            std::thread::sleep(Duration::from_millis(50));
            // SAFETY: the thread has not been joined.
            unsafe { libc::pthread_kill(waiting.as_pthread_t(), libc::SIGUSR2) };
        }
        let (found, elapsed) = waiting.join().unwrap();
        assert!(signalled.load(Ordering::SeqCst));
        assert_eq!(found, 0);
        assert!(elapsed >= Duration::from_millis(600), "{elapsed:?}");
    }
}
