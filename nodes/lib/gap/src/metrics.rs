//! Distances of measured and simulated readings.

use cromosim_imu::{Channel, PerChannel, Reading};
use cromosim_spatial::welch;

use crate::axes::{axes_of_channel, value_on_axis};
use crate::diagnosis::Metrics;
use crate::prepared::PreparedPlacement;

/// Length of the windows of the spectra that are compared, s.
const SPECTRUM_S: f64 = 2.56;

/// Readings to be compared, and which axes of which messages.
pub(crate) struct Comparison<'a> {
    pub prepared: &'a PreparedPlacement,
    pub measured: &'a [Reading],
    pub covered: &'a [[bool; 6]],
}

impl Comparison<'_> {
    /// Sums of the squared vector residuals.
    pub fn squares(&self, simulated: &[Reading]) -> PerChannel<f64> {
        PerChannel::from_fn(|channel| self.squares_and_count(simulated, channel).0)
    }

    /// Root mean square of the vector residual of a channel.
    fn rmse(&self, simulated: &[Reading], channel: Channel) -> f64 {
        let (sum, count) = self.squares_and_count(simulated, channel);
        (sum / count.max(1.0)).sqrt()
    }

    fn squares_and_count(&self, simulated: &[Reading], channel: Channel) -> (f64, f64) {
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for (k, covered) in self.covered.iter().enumerate() {
            if covered[axes_of_channel(channel).start] {
                sum += axes_of_channel(channel)
                    .map(|axis| {
                        let measured = value_on_axis(&self.measured[k], axis);
                        (measured - value_on_axis(&simulated[k], axis)).powi(2)
                    })
                    .sum::<f64>();
                count += 1.0;
            }
        }
        (sum, count)
    }

    /// All distances; `simulated` without noise, `noisy` with it.
    pub fn metrics(
        &self,
        simulated: &[Reading],
        noisy: &[Reading],
        nll_per_sample: f64,
    ) -> Metrics {
        let spectral = |channel| self.spectral_distance(noisy, channel);
        let distribution = |channel| self.wasserstein(noisy, channel);
        Metrics {
            accel_rmse: self.rmse(simulated, Channel::Accelerometer),
            gyro_rmse: self.rmse(simulated, Channel::Gyroscope),
            accel_log_spectral_distance_db: spectral(Channel::Accelerometer),
            gyro_log_spectral_distance_db: spectral(Channel::Gyroscope),
            accel_wasserstein: distribution(Channel::Accelerometer),
            gyro_wasserstein: distribution(Channel::Gyroscope),
            nll_per_sample,
        }
    }

    /// One axis of the readings on the sample grid.
    fn series(&self, readings: &[Reading], axis: usize) -> Vec<f64> {
        let mut last = 0.0;
        let mut series = vec![f64::NAN; self.prepared.length];
        for (k, &entry) in self.prepared.grid_index.iter().enumerate() {
            if self.covered[k][axis] {
                series[entry] = value_on_axis(&readings[k], axis);
            }
        }
        // Held over gaps, in both alike.
        for value in &mut series {
            if value.is_nan() {
                *value = last;
            }
            last = *value;
        }
        series
    }

    /// Root mean square over frequency (from two windows' resolution to Nyquist) of the difference
    /// in dB, mean over axes.
    fn spectral_distance(&self, noisy: &[Reading], channel: Channel) -> f64 {
        let window = ((SPECTRUM_S * self.prepared.rate_hz) as usize)
            .min(self.prepared.length / 2)
            .max(8);
        let axes = axes_of_channel(channel);
        let distances = axes.map(|axis| {
            let a = welch(
                &self.series(self.measured, axis),
                self.prepared.rate_hz,
                window,
            );
            let b = welch(&self.series(noisy, axis), self.prepared.rate_hz, window);
            let pairs = a.density.iter().zip(&b.density).skip(2);
            let (sum, count) = pairs.fold((0.0, 0.0_f64), |(sum, count), (a, b)| {
                let difference = 10.0 * (a.max(1e-20) / b.max(1e-20)).log10();
                (sum + difference * difference, count + 1.0)
            });
            (sum / count.max(1.0)).sqrt()
        });
        distances.sum::<f64>() / 3.0
    }

    /// First Wasserstein distance: mean distance of the sorted values, mean over axes.
    fn wasserstein(&self, noisy: &[Reading], channel: Channel) -> f64 {
        let sorted = |readings: &[Reading], axis: usize| {
            let covered = readings
                .iter()
                .zip(self.covered)
                .filter(|(_, covered)| covered[axis]);
            let mut values: Vec<f64> = covered
                .map(|(reading, _)| value_on_axis(reading, axis))
                .collect();
            values.sort_unstable_by(f64::total_cmp);
            values
        };
        let axes = axes_of_channel(channel);
        let distance = |axis: usize| {
            let (a, b) = (sorted(self.measured, axis), sorted(noisy, axis));
            a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len().max(1) as f64
        };
        axes.map(distance).sum::<f64>() / 3.0
    }
}
