//! Channels and axes of a reading, in the order of every array of this crate.

use std::ops::Range;

use cromosim_imu::{Channel, PerChannel, Reading};

/// Numbers of a channel's three axes among the six of a reading.
pub(crate) fn axes_of_channel(channel: Channel) -> Range<usize> {
    let first = 3 * channel.index();
    first..first + 3
}

/// The channel of an axis, by its number among the six of a reading.
pub(crate) fn channel_of_axis(axis: usize) -> Channel {
    Channel::ALL[axis / 3]
}

/// One of the six values of a reading, m/s2 or rad/s.
pub(crate) fn value_on_axis(reading: &Reading, axis: usize) -> f64 {
    reading[channel_of_axis(axis)][axis % 3]
}

/// The smaller of two channels' values.
pub(crate) fn smaller(values: PerChannel<f64>) -> f64 {
    values.accelerometer.min(values.gyroscope)
}

/// The larger of two channels' values.
pub(crate) fn larger(values: PerChannel<f64>) -> f64 {
    values.accelerometer.max(values.gyroscope)
}

/// Whether something holds of either channel.
pub(crate) fn any(values: PerChannel<bool>) -> bool {
    values.accelerometer || values.gyroscope
}

/// Sum over the channels.
pub(crate) fn sum_over_channels(value: impl FnMut(Channel) -> f64) -> f64 {
    Channel::ALL.into_iter().map(value).sum()
}
