//! How late each channel is against a simulation, farther than one linear step sees: a delay of a quarter of the motion's period
//! and more.

use cromosim_imu::{PerChannel, Reading};

use crate::axes::{axes_of_channel, value_on_axis};
use crate::policy::channel_lags::{CLOSER, REACH_S};
use crate::prepared::PreparedPlacement;

/// Lags of whole periods of the sample grid that bring the readings nearest to the simulation, s: positive where a channel is
/// late. 0 where that is not [`CLOSER`] than without one.
pub(crate) fn channel_lags(prepared: &PreparedPlacement, simulated: &[Reading]) -> PerChannel<f64> {
    let measured = prepared.on_sample_grid(|k, axis| value_on_axis(&prepared.measured[k], axis));
    let simulated = prepared.on_sample_grid(|k, axis| value_on_axis(&simulated[k], axis));
    let reach = (REACH_S * prepared.rate_hz) as i64;
    PerChannel::from_fn(|channel| {
        let axes = axes_of_channel(channel);
        let pairs = || measured[axes.clone()].iter().zip(&simulated[axes.clone()]);
        let distance = |lag: i64| {
            pairs()
                .map(|(measured, simulated)| mean_square(measured, simulated, lag))
                .sum::<f64>()
        };
        let least = (-reach..=reach)
            .map(|lag| (lag, distance(lag)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let told = least.filter(|(_, found)| *found < CLOSER * distance(0));
        told.map_or(0.0, |(lag, _)| lag as f64 / prepared.rate_hz)
    })
}

/// Of `measured(k) - simulated(k - lag)` over the entries that both have.
fn mean_square(measured: &[f64], simulated: &[f64], lag: i64) -> f64 {
    let skipped = lag.unsigned_abs() as usize;
    let (measured, simulated) = if lag < 0 {
        (measured, simulated.get(skipped..).unwrap_or_default())
    } else {
        (measured.get(skipped..).unwrap_or_default(), simulated)
    };
    let pairs = measured.iter().zip(simulated);
    let count = measured.len().min(simulated.len()).max(1);
    pairs.map(|(m, s)| (m - s).powi(2)).sum::<f64>() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_are_compared_where_both_are() {
        let measured = [9.0, 1.0, 2.0, 3.0];
        let simulated = [1.0, 2.0, 3.0, 7.0];
        assert_eq!(mean_square(&measured, &simulated, 1), 0.0);
        assert_eq!(mean_square(&simulated, &measured, -1), 0.0);
        assert!(mean_square(&measured, &simulated, 0) > 1.0);
        assert_eq!(mean_square(&measured, &simulated, 9), 0.0);
    }
}
