//! Distances of measured and simulated readings.

use cromosim_imu::Reading;
use cromosim_spatial::welch;

use crate::Metrics;
use crate::problem::{Problem, axis_of};

/// Readings to be compared, and which axes of which messages.
pub(crate) struct Comparison<'a> {
    pub problem: &'a Problem,
    pub measured: &'a [Reading],
    pub covered: &'a [[bool; 6]],
}

impl Comparison<'_> {
    /// Root mean square of the vector residual of a channel.
    pub fn rmse(&self, simulated: &[Reading], channel: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for (k, covered) in self.covered.iter().enumerate() {
            if covered[3 * channel] {
                sum += (3 * channel..3 * channel + 3)
                    .map(|a| (axis_of(&self.measured[k], a) - axis_of(&simulated[k], a)).powi(2))
                    .sum::<f64>();
                count += 1.0;
            }
        }
        (sum / count.max(1.0)).sqrt()
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
            accel_rmse: self.rmse(simulated, 0),
            gyro_rmse: self.rmse(simulated, 1),
            accel_log_spectral_distance_db: spectral(0),
            gyro_log_spectral_distance_db: spectral(1),
            accel_wasserstein: distribution(0),
            gyro_wasserstein: distribution(1),
            nll_per_sample,
        }
    }

    fn series(&self, readings: &[Reading], axis: usize) -> Vec<f64> {
        let mut last = 0.0;
        let mut series = vec![f64::NAN; self.problem.length];
        for (k, &place) in self.problem.places.iter().enumerate() {
            if self.covered[k][axis] {
                series[place] = axis_of(&readings[k], axis);
            }
        }
        // Held over holes, in both alike.
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
    fn spectral_distance(&self, noisy: &[Reading], channel: usize) -> f64 {
        let window = ((2.56 * self.problem.rate_hz) as usize)
            .min(self.problem.length / 2)
            .max(8);
        let axes = 3 * channel..3 * channel + 3;
        let distances = axes.map(|axis| {
            let a = welch(
                &self.series(self.measured, axis),
                self.problem.rate_hz,
                window,
            );
            let b = welch(&self.series(noisy, axis), self.problem.rate_hz, window);
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
    fn wasserstein(&self, noisy: &[Reading], channel: usize) -> f64 {
        let sorted = |readings: &[Reading], axis: usize| {
            let covered = readings
                .iter()
                .zip(self.covered)
                .filter(|(_, covered)| covered[axis]);
            let mut values: Vec<f64> = covered.map(|(reading, _)| axis_of(reading, axis)).collect();
            values.sort_unstable_by(f64::total_cmp);
            values
        };
        let axes = 3 * channel..3 * channel + 3;
        let distance = |axis: usize| {
            let (a, b) = (sorted(self.measured, axis), sorted(noisy, axis));
            a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len().max(1) as f64
        };
        axes.map(distance).sum::<f64>() / 3.0
    }
}
