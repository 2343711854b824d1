//! Time stamps in whole nanoseconds.

use std::ops::Sub;

/// A point in time: nanoseconds since the epoch of its clock (UNIX for live data, the recording's
/// own for replays).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Stamp {
    /// Nanoseconds since the clock's epoch.
    pub nanos: i64,
}

impl Stamp {
    /// The stamp `nanos` nanoseconds after the epoch.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self { nanos }
    }

    /// The stamp `seconds` after the epoch, rounded to the nearest nanosecond.
    pub fn from_seconds(seconds: f64) -> Self {
        Self {
            nanos: (seconds * 1e9).round() as i64,
        }
    }

    /// Seconds since the epoch. For stamps of today the result resolves 0.24 microseconds; subtract
    /// stamps first where that matters.
    pub fn as_seconds(self) -> f64 {
        self.nanos as f64 * 1e-9
    }

    /// This stamp moved by `seconds`, rounded to the nearest nanosecond.
    #[must_use]
    pub fn plus_seconds(self, seconds: f64) -> Self {
        Self {
            nanos: self.nanos + (seconds * 1e9).round() as i64,
        }
    }
}

impl Sub for Stamp {
    /// Seconds from `earlier` to this stamp.
    type Output = f64;

    fn sub(self, earlier: Self) -> f64 {
        (self.nanos - earlier.nanos) as f64 * 1e-9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_keep_nanoseconds_at_todays_epoch() {
        let start = Stamp::from_nanos(1_700_000_000_000_000_001);
        assert_eq!(start.plus_seconds(0.01) - start, 0.01);
        assert_eq!(Stamp::from_nanos(1_700_000_000_000_000_002) - start, 1e-9);
    }
}
