//! The node's time: the system's, or that of `/clock`.

use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use cromosim_spatial::Stamp;

use crate::shutdown::Shutdown;
use crate::wake::lock;

/// The node's clock. Cloning shares it.
///
/// With the parameter `use_sim_time` it shows what `/clock` (`rosgraph_msgs/msg/Clock`) said last,
/// and zero before the first message.
#[derive(Clone, Debug)]
pub struct Clock {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    simulated: AtomicBool,
    sim_nanos: AtomicI64,
    jumps: Mutex<u64>,
    ticked: Condvar,
    shutdown: Shutdown,
}

impl Clock {
    pub(crate) fn new(simulated: bool, shutdown: Shutdown) -> Self {
        let inner = Inner {
            simulated: AtomicBool::new(simulated),
            sim_nanos: AtomicI64::new(0),
            jumps: Mutex::new(0),
            ticked: Condvar::new(),
            shutdown,
        };
        Self {
            inner: Arc::new(inner),
        }
    }

    /// The system clock's time; with `use_sim_time`, what `/clock` said last.
    pub fn now(&self) -> Stamp {
        if self.is_simulated() {
            Stamp::from_nanos(self.inner.sim_nanos.load(Ordering::SeqCst))
        } else {
            system_now()
        }
    }

    /// The system clock, whatever `use_sim_time` says: for measuring latency.
    pub fn system_now() -> Stamp {
        system_now()
    }

    /// True where `/clock` is followed.
    pub fn is_simulated(&self) -> bool {
        self.inner.simulated.load(Ordering::SeqCst)
    }

    /// How often `/clock` has gone backwards (a replay that starts again, or a seek).
    pub fn jumps_back(&self) -> u64 {
        *lock(&self.inner.jumps)
    }

    /// Sleeps until the clock shows `stamp` or more; returns at once where it does already. False
    /// where the process is ending.
    pub fn sleep_until(&self, stamp: Stamp) -> bool {
        let mut jumps = lock(&self.inner.jumps);
        while !self.inner.shutdown.is_requested() {
            let left = stamp - self.now();
            if left <= 0.0 {
                return true;
            }
            // A simulated clock may stand still or change its rate: then only its ticks count. The
            // bound lets a shutdown through.
            let bound = if self.is_simulated() {
                0.1
            } else {
                left.min(0.1)
            };
            jumps = self
                .inner
                .ticked
                .wait_timeout(jumps, Duration::from_secs_f64(bound))
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        false
    }

    pub(crate) fn set_simulated(&self, simulated: bool) {
        self.inner.simulated.store(simulated, Ordering::SeqCst);
        self.inner.ticked.notify_all();
    }

    pub(crate) fn tick(&self, nanos: i64) {
        let mut jumps = lock(&self.inner.jumps);
        if nanos < self.inner.sim_nanos.swap(nanos, Ordering::SeqCst) {
            *jumps += 1;
        }
        drop(jumps);
        self.inner.ticked.notify_all();
    }
}

/// What the system clock shows, since the UNIX epoch.
pub(crate) fn system_now() -> Stamp {
    let nanos = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos());
    Stamp::from_nanos(i64::try_from(nanos).unwrap_or(i64::MAX))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn simulated_time_is_what_the_ticks_say() {
        let clock = Clock::new(true, Shutdown::new());
        assert_eq!(clock.now(), Stamp::from_nanos(0));
        let sleeper = std::thread::spawn({
            let clock = clock.clone();
            move || (clock.sleep_until(Stamp::from_nanos(20)), clock.now())
        });
        clock.tick(10);
        clock.tick(20);
        assert_eq!(sleeper.join().unwrap(), (true, Stamp::from_nanos(20)));
        clock.tick(5);
        assert_eq!((clock.jumps_back(), clock.now()), (1, Stamp::from_nanos(5)));
        clock.set_simulated(false);
        assert!(clock.now() > Stamp::from_nanos(20));
    }

    #[test]
    fn a_shutdown_ends_the_sleep() {
        let shutdown = Shutdown::new();
        shutdown.request();
        assert!(!Clock::new(true, shutdown).sleep_until(Stamp::from_nanos(1)));
    }
}
