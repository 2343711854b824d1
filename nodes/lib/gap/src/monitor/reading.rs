//! Messages of one IMU: how regularly they come, how noisy they are.

use cromosim_imu::{Channel, PerChannel, Reading};
use cromosim_spatial::{MEDIAN_OF_SQUARE, Stamp, fourth_difference, white_noise_variance};
use nalgebra::Vector3;

use crate::axes::axes_of_channel;
use crate::period::median_period;

/// One message of an IMU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuReading {
    /// Its stamp.
    pub stamp: Stamp,
    /// Accelerometer [m/s2], gyroscope [rad/s], in sensor axes.
    pub values: [f64; 6],
}

impl ImuReading {
    /// Its values by channel.
    pub(super) fn by_channel(&self) -> Reading {
        let [fx, fy, fz, wx, wy, wz] = self.values;
        Reading {
            specific_force: Vector3::new(fx, fy, fz),
            angular_velocity: Vector3::new(wx, wy, wz),
        }
    }
}

/// How regularly messages come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pace {
    /// From the median interval, Hz; 0 for fewer than two messages.
    pub rate_hz: f64,
    /// Messages that are missing between others.
    pub dropped: usize,
}

/// Rate and missing messages of a stream in order of its stamps.
pub fn pace(readings: &[ImuReading]) -> Pace {
    let Some(period) = period(readings) else {
        return Pace::default();
    };
    let missing = |pair: &[ImuReading]| {
        (((pair[1].stamp - pair[0].stamp) / period).round() as usize).saturating_sub(1)
    };
    Pace {
        rate_hz: 1.0 / period,
        dropped: readings.windows(2).map(missing).sum(),
    }
}

/// Median interval of a stream, s.
pub(super) fn period(readings: &[ImuReading]) -> Option<f64> {
    median_period(readings.iter().map(|reading| reading.stamp))
}

/// White noise of a reading, standard deviation per axis by channel, m/s2 and rad/s: the root mean
/// square over the axes of what their fourth differences tell; 0 where there are too few readings.
pub fn noise_floors(readings: &[ImuReading]) -> PerChannel<f64> {
    let Some(period) = period(readings) else {
        return PerChannel::default();
    };
    let whole = |run: &&[ImuReading]| run[4].stamp - run[0].stamp < 4.5 * period;
    let variance = |axis: usize| {
        let values = |run: &[ImuReading]| std::array::from_fn(|k| run[k].values[axis]);
        let mut differences: Vec<f64> = readings
            .windows(5)
            .filter(whole)
            .map(|run| fourth_difference(values(run)))
            .collect();
        white_noise_variance(&mut differences, MEDIAN_OF_SQUARE).unwrap_or(0.0)
    };
    let floor =
        |channel: Channel| (axes_of_channel(channel).map(variance).sum::<f64>() / 3.0).sqrt();
    PerChannel::from_fn(floor)
}
