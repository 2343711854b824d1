//! From devices' readings to windows on a common grid.

use cromosim_imu::Reading;
use cromosim_learned::Examples;

use crate::low_pass::ZeroPhaseLowPass;

/// Channels of a device: specific force (m/s2) and angular velocity (rad/s), three axes each.
pub const CHANNELS_PER_DEVICE: usize = 6;
/// Readings are brought to at least this rate before they are low-passed, Hz.
const FINE_HZ: usize = 100;
/// Readings beyond an end that the low-pass is given.
const MIRRORED: usize = 40;

/// The rate, length and spacing of windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowGrid {
    /// Samples per second, Hz.
    pub rate_hz: usize,
    /// Cutoff of the low-pass, Hz.
    pub low_pass_hz: f64,
    /// Samples of a window.
    pub window: usize,
    /// Samples from one window's start to the next one's.
    pub hop: usize,
}

/// Readings of one device, in the order of time.
#[derive(Clone, Debug, Default)]
pub struct DeviceReadings {
    /// Times of the readings, s.
    pub seconds: Vec<f64>,
    /// Specific force x, y, z, m/s2, then angular velocity x, y, z, rad/s; sensor axes.
    pub values: Vec<[f64; CHANNELS_PER_DEVICE]>,
}

impl DeviceReadings {
    /// Adds a reading at the end.
    pub fn push(&mut self, seconds: f64, reading: &Reading) {
        let (f, w) = (reading.specific_force, reading.angular_velocity);
        self.seconds.push(seconds);
        self.values.push([f.x, f.y, f.z, w.x, w.y, w.z]);
    }
}

impl WindowGrid {
    /// Samples between two times, both included, s.
    pub fn samples(&self, seconds: f64) -> usize {
        // A whole number of samples must not be lost to rounding.
        (seconds * self.rate_hz as f64 + 1e-6).floor().max(0.0) as usize + 1
    }

    /// Devices beside each other, (samples, devices x 6), from `start` on: linear between readings
    /// onto a finer grid, low-passed there without delay, thinned out. Before the first and behind
    /// the last reading these are held.
    pub fn sampled(&self, devices: &[DeviceReadings], start: f64, samples: usize) -> Vec<f32> {
        let every = FINE_HZ.div_ceil(self.rate_hz);
        let fine_hz = (every * self.rate_hz) as f64;
        let count = (samples.max(1) - 1) * every + 1;
        let width = devices.len() * CHANNELS_PER_DEVICE;
        let mut all = vec![0.0; samples * width];
        let filter = ZeroPhaseLowPass::new(self.low_pass_hz, fine_hz).mirroring(MIRRORED);
        for (device, series) in devices.iter().enumerate() {
            let fine = resampled(series, start, count, fine_hz);
            for channel in 0..CHANNELS_PER_DEVICE {
                let mut values: Vec<f64> = fine.iter().map(|value| value[channel]).collect();
                filter.both_ways(&mut values);
                for (sample, value) in values.iter().step_by(every).enumerate() {
                    all[sample * width + device * CHANNELS_PER_DEVICE + channel] = *value as f32;
                }
            }
        }
        all
    }

    /// Starts and classes of windows from sample `first` on: the class that more than half of a
    /// window's samples have. Windows without such a class are left out.
    pub fn windows(&self, labels: &[Option<u8>], first: usize) -> Vec<(usize, u8)> {
        let last = labels.len().checked_sub(self.window);
        let starts = last
            .into_iter()
            .flat_map(|last| (first..=last).step_by(self.hop));
        starts
            .filter_map(|start| Some((start, majority(&labels[start..start + self.window])?)))
            .collect()
    }

    /// Cuts windows out of what [`WindowGrid::sampled`] gave.
    pub fn cut(&self, sampled: &[f32], windows: &[(usize, u8)], examples: &mut Examples) {
        for (start, label) in windows {
            examples.push(
                &sampled[start * examples.channels..(start + self.window) * examples.channels],
                *label,
            );
        }
    }
}

/// The label of more than half (Boyer and Moore's vote, and a count of whoever is left).
fn majority(labels: &[Option<u8>]) -> Option<u8> {
    let (mut candidate, mut ahead) = (None, 0);
    for label in labels {
        match ahead {
            0 => (candidate, ahead) = (*label, 1),
            _ if *label == candidate => ahead += 1,
            _ => ahead -= 1,
        }
    }
    candidate
        .filter(|_| 2 * labels.iter().filter(|label| **label == candidate).count() > labels.len())
}

fn resampled(
    series: &DeviceReadings,
    start: f64,
    count: usize,
    rate_hz: f64,
) -> Vec<[f64; CHANNELS_PER_DEVICE]> {
    let mut after = 0;
    let at = |k: usize| {
        let seconds = start + k as f64 / rate_hz;
        while after < series.seconds.len() && series.seconds[after] < seconds {
            after += 1;
        }
        match (after.checked_sub(1), series.values.get(after)) {
            (None, None) => [0.0; CHANNELS_PER_DEVICE],
            (None, Some(value)) => *value,
            (Some(before), None) => series.values[before],
            (Some(before), Some(later)) => {
                let (from, to) = (series.seconds[before], series.seconds[after]);
                let part = (seconds - from) / (to - from);
                std::array::from_fn(|channel| {
                    series.values[before][channel]
                        + part * (later[channel] - series.values[before][channel])
                })
            }
        }
    };
    (0..count).map(at).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::PI;

    use super::*;

    const GRID: WindowGrid = WindowGrid {
        rate_hz: 30,
        low_pass_hz: 10.0,
        window: 6,
        hop: 3,
    };

    fn series(value: impl Fn(f64) -> f64) -> DeviceReadings {
        // Uneven, with a gap of 60 ms.
        let seconds: Vec<f64> = (0..400)
            .filter(|k| !(200..206).contains(k))
            .map(|k| f64::from(k) * 0.01 + if k % 3 == 0 { 0.002 } else { 0.0 })
            .collect();
        let values = seconds
            .iter()
            .map(|t| [value(*t), 1.0, -2.0, 0.0, value(2.0 * t), 3.0])
            .collect();
        DeviceReadings { seconds, values }
    }

    #[test]
    fn slow_motion_stays_and_fast_noise_goes() {
        let slow = |t: f64| (2.0 * PI * 0.8 * t).sin();
        let sampled = GRID.sampled(
            &[
                series(slow),
                series(|t| slow(t) + (2.0 * PI * 35.0 * t).sin()),
            ],
            0.5,
            80,
        );
        let mut noise = 0.0;
        for (k, row) in sampled.chunks(12).enumerate() {
            let expected = slow(0.5 + k as f64 / 30.0) as f32;
            assert!((row[0] - expected).abs() < 0.01, "sample {k}: {row:?}");
            assert!((row[1] - 1.0).abs() < 1e-6 && (row[11] - 3.0).abs() < 1e-6);
            noise += (row[6] - expected).powi(2) / 80.0;
        }
        // Of an amplitude of 1 at 35 Hz; linear interpolation between uneven stamps moves some of
        // it to lower frequencies.
        assert!(noise.sqrt() < 0.12, "{}", noise.sqrt());
        let level: Vec<f32> = GRID
            .sampled(&[series(|_| 4.0)], -1.0, 300)
            .chunks(6)
            .map(|row| row[0])
            .collect();
        assert!(level.iter().all(|value| (value - 4.0).abs() < 1e-5));
    }

    #[test]
    fn windows_take_the_class_of_more_than_half() {
        let mut labels = vec![Some(2); 6];
        labels.extend([None, None, None, Some(1), Some(1), Some(1), Some(1), None]);
        // From 0: all 2. From 3: three of six are 2, not more than half. From 6: three of six are
        // 1.
        assert_eq!(GRID.windows(&labels, 0), [(0, 2)]);
        assert_eq!(GRID.windows(&labels, 1), [(1, 2), (7, 1)]);
        assert!(GRID.windows(&labels[..5], 0).is_empty());
        let mut examples = Examples::new(6, 1);
        GRID.cut(
            &(0..14).map(|k| k as f32).collect::<Vec<_>>(),
            &[(7, 1)],
            &mut examples,
        );
        assert_eq!(
            (examples.window(0), examples.labels.as_slice()),
            (&[7.0, 8.0, 9.0, 10.0, 11.0, 12.0][..], &[1][..])
        );
    }

    #[test]
    fn a_duration_of_whole_samples_has_one_more() {
        assert_eq!(
            (
                GRID.samples(1.0),
                GRID.samples(0.1 + 0.2),
                GRID.samples(-1.0)
            ),
            (31, 10, 1)
        );
    }
}
