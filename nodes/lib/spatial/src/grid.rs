//! Times: checks, lookup and output grids.

use crate::{SpatialError, Stamp};

/// Most stamps that are made at once: two days at 100 Hz, whose samples take some gigabytes.
const MAX_STAMPS: f64 = 2e7;

/// Checks that times (s) are finite and strictly increasing.
///
/// # Errors
/// [`SpatialError::NotFinite`], [`SpatialError::TimeNotIncreasing`].
pub fn check_times(seconds: &[f64]) -> Result<(), SpatialError> {
    if let Some(index) = seconds.iter().position(|t| !t.is_finite()) {
        return Err(SpatialError::NotFinite {
            index,
            what: "time",
        });
    }
    match seconds.windows(2).position(|w| w[1] <= w[0]) {
        Some(k) => Err(SpatialError::TimeNotIncreasing {
            index: k + 1,
            previous: seconds[k],
            next: seconds[k + 1],
        }),
        None => Ok(()),
    }
}

/// Seconds of each stamp since `origin`, exact to a nanosecond over a hundred days.
pub fn relative_seconds(stamps: &[Stamp], origin: Stamp) -> Vec<f64> {
    stamps.iter().map(|stamp| *stamp - origin).collect()
}

/// Stamps `first + k / rate` for k = 0, 1, ... up to and including `last`; each rounded to its own
/// nearest nanosecond, so that no error adds up.
///
/// # Errors
/// [`SpatialError::BadRate`] for a rate that is not positive and finite,
/// [`SpatialError::TooManyStamps`] beyond twenty million.
pub fn uniform_stamps(first: Stamp, last: Stamp, rate_hz: f64) -> Result<Vec<Stamp>, SpatialError> {
    if !(rate_hz > 0.0 && rate_hz.is_finite()) {
        return Err(SpatialError::BadRate { rate_hz });
    }
    check_count((last - first) * rate_hz + 1.0, rate_hz)?;
    let stamps = (0..).map_while(|k: i64| {
        let stamp = first.plus_seconds(k as f64 / rate_hz);
        (stamp <= last).then_some(stamp)
    });
    Ok(stamps.collect())
}

/// Refuses more entries than fit into memory.
pub(crate) fn check_count(count: f64, rate_hz: f64) -> Result<(), SpatialError> {
    if count > MAX_STAMPS {
        return Err(SpatialError::TooManyStamps {
            count,
            limit: MAX_STAMPS,
            rate_hz,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn duplicates_and_time_going_backwards_are_named() {
        assert_eq!(
            check_times(&[0.0, 0.1, 0.1]),
            Err(SpatialError::TimeNotIncreasing {
                index: 2,
                previous: 0.1,
                next: 0.1
            })
        );
        assert_eq!(
            check_times(&[0.0, 0.1, 0.05]),
            Err(SpatialError::TimeNotIncreasing {
                index: 2,
                previous: 0.1,
                next: 0.05
            })
        );
        assert_eq!(
            check_times(&[0.0, f64::NAN]),
            Err(SpatialError::NotFinite {
                index: 1,
                what: "time"
            })
        );
        assert_eq!(check_times(&[0.0, 0.1, 0.35]), Ok(()));
    }

    #[test]
    fn uniform_stamps_do_not_drift() {
        let first = Stamp::from_nanos(1_700_000_000_000_000_000);
        let stamps = uniform_stamps(first, first.plus_seconds(3600.0), 300.0).unwrap();
        assert_eq!(stamps.len(), 3600 * 300 + 1);
        assert_eq!(stamps[300 * 1800] - first, 1800.0);
        assert!(uniform_stamps(first, first, -1.0).is_err());
        let many = uniform_stamps(first, first.plus_seconds(10.0), 1e9);
        assert!(
            matches!(many, Err(SpatialError::TooManyStamps { .. })),
            "ten thousand million stamps are refused"
        );
    }
}
