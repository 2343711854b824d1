//! What recordings of IMUs alone tell of a device, and virtual readings with it: noise, biases,
//! resolution and stamps.
//!
//! Without a reference nothing is known of gains, delays, low-passes, or of how soft the flesh
//! under a device is: `cromosim diagnose` needs pairs for that. What does not hang on the motion is
//! read off: white noise from the median third difference while the device is at rest, constant
//! angular velocities there as biases (of the accelerometer they cannot be told from tilts), the
//! resolution from the lattice that all readings lie on, and the intervals between stamps with
//! their gaps.

use cromosim_imu::{
    Channel, DeclaredNoise, Effect, EffectKind, EffectSet, GridTrace, MeasurementInput,
    NoiseSource, Reading, SensorModel, lattice_spacing, normal_pair, white_noise_density,
};
use cromosim_spatial::Stamp;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use serde::Serialize;

use super::scores::mean;
use super::windows::DeviceReadings;
use crate::EvaluationError;

/// Length of the intervals that are looked at for rest, s.
const REST_SECONDS: f64 = 1.0;
/// A sensor whose angular velocities scatter by more is not at rest, rad/s.
const REST_SCATTER: f64 = 0.05;
/// Fewer readings in an interval of rest are too few.
const REST_READINGS: usize = 20;
/// A mean angular velocity beyond this is a turn of the sensor, not a bias, rad/s.
const MOST_BIAS: f64 = 0.1;

/// What recordings of one placement's devices tell of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeviceEstimate {
    /// Intervals of rest that noise and biases were read off.
    pub rests: usize,
    /// White noise of the accelerometer, (m/s2)/sqrt(Hz).
    pub accel_noise: f64,
    /// White noise of the gyroscope, (rad/s)/sqrt(Hz).
    pub gyro_noise: f64,
    /// Mean over the rests of their mean angular velocities, each axis, rad/s.
    pub gyro_bias: [f64; 3],
    /// Standard deviation over the rests of the same, rad/s.
    pub gyro_bias_std: [f64; 3],
    /// Resolution of the accelerometer, m/s2; 0 where readings lie on no lattice.
    pub accel_step: f64,
    /// Resolution of the gyroscope, rad/s; 0 where readings lie on no lattice.
    pub gyro_step: f64,
    /// Median interval between stamps, s.
    pub interval: f64,
    /// Share of time in intervals of more than twice the median.
    pub in_gaps: f64,
    /// The intervals between stamps of each stretch, s.
    #[serde(skip)]
    intervals: Vec<Vec<f64>>,
}

impl DeviceEstimate {
    /// What the stretches of one device tell.
    pub(super) fn from_stretches(stretches: &[&DeviceReadings]) -> Self {
        let rests: Vec<Rest> = stretches
            .iter()
            .flat_map(|readings| rests(readings))
            .collect();
        let over_rests = |value: fn(&Rest) -> f64| median(rests.iter().map(value).collect());
        let [gyro_bias, gyro_bias_std] = biases(&rests);
        let intervals: Vec<Vec<f64>> = stretches
            .iter()
            .map(|readings| intervals(&readings.seconds))
            .collect();
        let all: Vec<f64> = intervals.iter().flatten().copied().collect();
        let interval = median(all.clone());
        let long: f64 = all.iter().filter(|own| **own > 2.0 * interval).sum();
        Self {
            rests: rests.len(),
            accel_noise: over_rests(|rest| rest.accel_noise),
            gyro_noise: over_rests(|rest| rest.gyro_noise),
            gyro_bias,
            gyro_bias_std,
            accel_step: resolution(stretches, 0..3),
            gyro_step: resolution(stretches, 3..6),
            interval,
            in_gaps: long / all.iter().sum::<f64>().max(f64::MIN_POSITIVE),
            intervals: intervals
                .into_iter()
                .filter(|own| !own.is_empty())
                .collect(),
        }
    }

    /// What such a device reads where an error-free one reads `ideal`, which begins at 0 s; each
    /// seed another device.
    ///
    /// # Errors
    /// [`cromosim_imu::EffectError`], [`cromosim_imu::ImuError`] for estimates beyond what an
    /// effect allows.
    pub(super) fn simulate(
        &self,
        ideal: &GridTrace,
        seed: u64,
    ) -> Result<DeviceReadings, EvaluationError> {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let mut effects = EffectSet::new();
        let ([x, y], [z, _]) = (normal_pair(&mut random), normal_pair(&mut random));
        let bias = [x, y, z]
            .into_iter()
            .zip(self.gyro_bias.iter().zip(self.gyro_bias_std))
            .map(|(normal, (mean, std))| mean + std * normal);
        effects.insert(Effect::new(EffectKind::GyroBias, bias.collect())?);
        for (kind, step) in [
            (EffectKind::AccelQuantization, self.accel_step),
            (EffectKind::GyroQuantization, self.gyro_step),
        ] {
            effects.insert(Effect::new(kind, vec![step])?);
        }
        let stamps = self.stamps(
            (ideal.specific_force.len().max(1) - 1) as f64 / ideal.rate_hz,
            &mut random,
        );
        let model = SensorModel::new(&effects, Stamp::default());
        let declared = DeclaredNoise {
            accel_density: self.accel_noise,
            gyro_density: self.gyro_noise,
        };
        let mut noise = None;
        if self.interval > 0.0 {
            let rate_hz = self.interval.recip();
            noise = Some(NoiseSource::white(
                &declared,
                0.0,
                rate_hz,
                seed,
                "estimated",
            )?);
        }
        let input = MeasurementInput::IdealReadings(ideal);
        let readings = model.measure(input, &stamps, |readings| {
            noise.iter_mut().for_each(|noise| noise.add_to(readings));
        });
        let mut series = DeviceReadings::default();
        stamps
            .iter()
            .zip(&readings)
            .for_each(|(stamp, reading)| series.push(stamp.as_seconds(), reading));
        Ok(series)
    }

    /// From 0 on: the intervals of a stretch from a drawn place on, and of the next ones where it
    /// ends.
    fn stamps(&self, seconds: f64, random: &mut ChaCha12Rng) -> Vec<Stamp> {
        let mut at = 0.0;
        let mut stamps = vec![Stamp::from_seconds(at)];
        if self.intervals.is_empty() {
            return stamps;
        }
        let stretch = random.random_range(0..self.intervals.len());
        let first = random.random_range(0..self.intervals[stretch].len());
        let rest = self.intervals.iter().cycle().skip(stretch + 1).flatten();
        for interval in self.intervals[stretch][first..].iter().chain(rest) {
            at += interval;
            if at > seconds {
                break;
            }
            stamps.push(Stamp::from_seconds(at));
        }
        stamps
    }
}

/// Mean and standard deviation over the rests of the gyroscope's bias, each axis, rad/s.
fn biases(rests: &[Rest]) -> [[f64; 3]; 2] {
    let biases: Vec<Vector3<f64>> = rests
        .iter()
        .map(|rest| rest.mean_rate)
        .filter(|rate| rate.amax() < MOST_BIAS)
        .collect();
    let axis = |axis: usize| biases.iter().map(|bias| bias[axis]).collect::<Vec<_>>();
    let means = [0, 1, 2].map(|k| mean(&axis(k)));
    let deviations = [0, 1, 2].map(|k| {
        let squares = axis(k)
            .iter()
            .map(|bias| (bias - means[k]).powi(2))
            .collect::<Vec<_>>();
        mean(&squares).sqrt()
    });
    [means, deviations]
}

/// The spacing of the lattice that all readings of some channels lie on; 0 without one.
fn resolution(stretches: &[&DeviceReadings], channels: std::ops::Range<usize>) -> f64 {
    let mut values: Vec<f64> = stretches
        .iter()
        .flat_map(|readings| &readings.values)
        .flat_map(|value| value[channels.clone()].to_vec())
        .collect();
    lattice_spacing(&mut values).unwrap_or(0.0)
}

fn intervals(seconds: &[f64]) -> Vec<f64> {
    seconds.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// A second at rest.
struct Rest {
    mean_rate: Vector3<f64>,
    accel_noise: f64,
    gyro_noise: f64,
}

fn rests(series: &DeviceReadings) -> Vec<Rest> {
    let (mut found, mut first) = (Vec::new(), 0);
    while first < series.seconds.len() {
        let end = series
            .seconds
            .partition_point(|seconds| *seconds < series.seconds[first] + REST_SECONDS);
        if end < series.seconds.len() && end - first >= REST_READINGS {
            found.extend(rest(
                &series.seconds[first..end],
                &series.values[first..end],
            ));
        }
        first = end;
    }
    found
}

fn rest(seconds: &[f64], values: &[[f64; 6]]) -> Option<Rest> {
    let readings: Vec<Reading> = values
        .iter()
        .map(|[a, b, c, x, y, z]| Reading {
            specific_force: [*a, *b, *c].into(),
            angular_velocity: [*x, *y, *z].into(),
        })
        .collect();
    let count = readings.len() as f64;
    let mean_rate = readings
        .iter()
        .map(|reading| reading.angular_velocity)
        .sum::<Vector3<f64>>()
        / count;
    let scatter = readings
        .iter()
        .map(|reading| (reading.angular_velocity - mean_rate).norm_squared())
        .sum::<f64>()
        / (3.0 * count);
    if scatter.sqrt() > REST_SCATTER {
        return None;
    }
    let rate_hz = (count - 1.0) / (seconds[seconds.len() - 1] - seconds[0]);
    let density = |channel| white_noise_density(&readings, channel, rate_hz);
    Some(Rest {
        mean_rate,
        accel_noise: density(Channel::Accelerometer),
        gyro_noise: density(Channel::Gyroscope),
    })
}

/// The upper median; 0 of no values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A device of known noise and bias that rests, turns, and rests; every twentieth interval is
    /// three times as long.
    fn recorded(seed: u64) -> DeviceReadings {
        let known = DeclaredNoise {
            accel_density: 0.003,
            gyro_density: 0.0004,
        };
        let mut noise = NoiseSource::white(&known, 0.0, 100.0, seed, "test").unwrap();
        let (mut series, mut seconds) = (DeviceReadings::default(), 0.0_f64);
        for k in 0..3000 {
            let added = noise.draw();
            let turning = if (1000..2000).contains(&k) {
                (seconds * 7.0).sin()
            } else {
                0.0
            };
            let angular_velocity =
                Vector3::new(0.01 + turning, -0.02, 0.0) + added.angular_velocity;
            let specific_force = (Vector3::new(0.0, 9.8, 0.0) + added.specific_force)
                .map(|value| (value / 0.0625).round() * 0.0625);
            series.push(
                seconds,
                &Reading {
                    specific_force,
                    angular_velocity,
                },
            );
            seconds += if k % 20 == 19 { 0.03 } else { 0.01 };
        }
        series
    }

    #[test]
    fn noise_bias_resolution_and_gaps_are_read_off() {
        let (one, two) = (recorded(1), recorded(2));
        let estimate = DeviceEstimate::from_stretches(&[&one, &two]);
        assert!((30..42).contains(&estimate.rests), "{}", estimate.rests);
        assert!(
            (estimate.gyro_noise / 0.0004 - 1.0).abs() < 0.15,
            "{}",
            estimate.gyro_noise
        );
        assert!(
            (estimate.gyro_bias[0] - 0.01).abs() < 1e-3
                && (estimate.gyro_bias[1] + 0.02).abs() < 1e-3,
            "{:?}",
            estimate.gyro_bias
        );
        assert!((estimate.accel_step - 0.0625).abs() < 1e-9 && estimate.gyro_step == 0.0);
        assert!(
            (estimate.interval - 0.01).abs() < 1e-9 && (estimate.in_gaps - 3.0 / 22.0).abs() < 0.01,
            "{}",
            estimate.in_gaps
        );
    }

    #[test]
    fn a_virtual_device_shows_what_was_read_off() {
        let estimate = DeviceEstimate::from_stretches(&[&recorded(1)]);
        let ideal = GridTrace {
            start: Stamp::default(),
            rate_hz: 100.0,
            specific_force: vec![Vector3::new(0.0, 0.0, 9.81); 2000],
            angular_velocity: vec![Vector3::zeros(); 2000],
        };
        let (read, again, other) = (
            estimate.simulate(&ideal, 5).unwrap(),
            estimate.simulate(&ideal, 5).unwrap(),
            estimate.simulate(&ideal, 6).unwrap(),
        );
        assert_eq!(read.values, again.values);
        assert_ne!(read.values, other.values);
        let same = DeviceEstimate::from_stretches(&[&read]);
        assert!(
            (same.gyro_noise / estimate.gyro_noise - 1.0).abs() < 0.2
                && (same.accel_step - 0.0625).abs() < 1e-9
        );
        assert!(
            (same.in_gaps - estimate.in_gaps).abs() < 0.03
                && *read.seconds.last().unwrap() <= 19.99
        );
        assert!(
            (same.gyro_bias[1] + 0.02).abs() < 2e-3,
            "{:?}",
            same.gyro_bias
        );
    }
}
