//! The clock by which a replay waits, whatever `/clock` says: often it is the replay's own.

use cromosim_ros::Clock;

/// What the system clock shows, ns since the UNIX epoch.
pub fn system_nanos() -> i64 {
    Clock::system_now().nanos
}
