//! What messages state of their errors, live and offline.

use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use crate::effects::StatedBiases;
use crate::rounding::{expected_rounding, expected_rounding_adds, rounding_difference};
use crate::{
    Channel, DeclaredNoise, Device, EffectSet, PerChannel, Reading, SampleVariance, SensorModel,
    UnexplainedErrors,
};

/// How far the readings of a device may be off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StatedErrors {
    /// Variances per sample and axis of what is the device's own, in the units that it reports: its
    /// white noise, its rounding (step^2 / 12), the spread of its turn-on bias and bias instability, and
    /// what stays unexplained.
    pub own: PerChannel<f64>,
    /// Its steps, in the units that it reports.
    steps: PerChannel<f64>,
    unexplained: UnexplainedErrors,
    /// What the walk of its biases adds per second, SI units squared.
    walk: PerChannel<f64>,
    units: PerChannel<f64>,
}

impl StatedErrors {
    /// Of a device with these effects beyond its declared noise, read at a rate.
    pub fn new(
        effects: &EffectSet,
        declared: &DeclaredNoise,
        unexplained: UnexplainedErrors,
        rate_hz: f64,
    ) -> Self {
        let noise = SensorModel::new(effects, Stamp::default()).total_noise(declared);
        let biases = StatedBiases::new(effects);
        let units = PerChannel::from_fn(|channel| effects.unit_factor(channel));
        let own = PerChannel::from_fn(|channel| {
            let density = match channel {
                Channel::Accelerometer => noise.accel_density,
                Channel::Gyroscope => noise.gyro_density,
            };
            let rounding = effects.lsb(channel).powi(2) / 12.0;
            let si = density.powi(2) * rate_hz
                + rounding
                + biases.steady[channel]
                + unexplained.variance[channel];
            si * units[channel].powi(2)
        });
        Self {
            own,
            steps: PerChannel::from_fn(|channel| effects.lsb(channel) * units[channel]),
            unexplained,
            walk: biases.per_second,
            units,
        }
    }

    /// Of a device as its file describes it.
    pub fn of_device(device: &Device, rate_hz: f64) -> Self {
        let declared = device.declared_noise();
        Self::new(device.effects(), &declared, device.unexplained(), rate_hz)
    }

    /// [`StatedErrors::own`] without the rounding.
    pub fn own_unrounded(&self) -> PerChannel<f64> {
        PerChannel::from_fn(|channel| self.own[channel] - self.steps[channel].powi(2) / 12.0)
    }

    /// The variance of a reading's motion with what rounding adds where the simulated reading and the real one
    /// are both rounded, see [`rounding_difference`].
    pub fn with_rounding(&self, variance: SampleVariance, reading: &Reading) -> SampleVariance {
        let of = self.before_rounding(&variance, reading);
        let added =
            PerChannel::from_fn(|channel| rounding_difference(of[channel], self.steps[channel]));
        with_added(variance, added)
    }

    /// What a device that rounds reads in the mean, of a reading that is not rounded yet, and the variance of its motion
    /// with what rounding adds to that, see [`expected_rounding`].
    pub fn expected_rounding(
        &self,
        variance: SampleVariance,
        reading: &Reading,
    ) -> (SampleVariance, Reading) {
        let of = self.before_rounding(&variance, reading);
        let rounded = |channel: Channel| {
            let (step, variance) = (self.steps[channel], of[channel]);
            reading[channel].map(|value| expected_rounding(value, step, variance))
        };
        let expected = Reading {
            specific_force: rounded(Channel::Accelerometer),
            angular_velocity: rounded(Channel::Gyroscope),
        };
        let added =
            PerChannel::from_fn(|channel| expected_rounding_adds(of[channel], self.steps[channel]));
        (with_added(variance, added), expected)
    }

    /// Variance per axis of a reading before it is rounded.
    fn before_rounding(&self, variance: &SampleVariance, reading: &Reading) -> PerChannel<f64> {
        let own = self.own_unrounded();
        let turned = |channel| 2.0 / 3.0 * variance.orientation * reading[channel].norm_squared();
        PerChannel {
            accelerometer: own.accelerometer
                + variance.acceleration
                + turned(Channel::Accelerometer),
            gyroscope: own.gyroscope + variance.angular_velocity + turned(Channel::Gyroscope),
        }
    }

    /// A reading as the device knows it, SI units, whatever it reports.
    pub fn in_si(&self, reading: &Reading) -> Reading {
        Reading {
            specific_force: reading.specific_force / self.units.accelerometer,
            angular_velocity: reading.angular_velocity / self.units.gyroscope,
        }
    }

    /// Mean square of the time that each channel may be late at some time after a recording's first
    /// message, s2.
    pub fn late_squared(&self, after_s: f64) -> PerChannel<f64> {
        PerChannel::from_fn(|channel| self.unexplained.late[channel].at(after_s).powi(2))
    }

    /// What errors of the poses leave (`variance`, in SI units), motion that they cover included, in the
    /// units that the device reports; with what its biases have walked in so many seconds.
    pub fn of_motion(&self, variance: SampleVariance, walked_s: f64) -> SampleVariance {
        let factor = PerChannel::from_fn(|channel| {
            (1.0 + self.unexplained.reference_excess[channel]) * self.units[channel].powi(2)
        });
        let walked = |channel| walked_s * self.walk[channel] * self.units[channel].powi(2);
        SampleVariance {
            acceleration: variance.acceleration * factor.accelerometer
                + walked(Channel::Accelerometer),
            angular_velocity: variance.angular_velocity * factor.gyroscope
                + walked(Channel::Gyroscope),
            ..variance
        }
    }
}

/// What readings change by per second around one of them, from its neighbours but one; none where these have
/// one stamp.
pub fn change_per_second(k: usize, stamps: &[Stamp], readings: &[Reading]) -> Option<Reading> {
    let (from, to) = (k.saturating_sub(2), (k + 2).min(readings.len() - 1));
    let seconds = stamps[to] - stamps[from];
    let change =
        |of: fn(&Reading) -> Vector3<f64>| (of(&readings[to]) - of(&readings[from])) / seconds;
    (seconds > 0.0).then(|| Reading {
        specific_force: change(|reading| reading.specific_force),
        angular_velocity: change(|reading| reading.angular_velocity),
    })
}

/// What stamps add to a reading's variances that are late by unknown times with these mean squares (s2): the
/// square of the reading's change in that time, mean over the axes.
pub(crate) fn with_clock_errors(
    variance: SampleVariance,
    late_squared: PerChannel<f64>,
    k: usize,
    stamps: &[Stamp],
    readings: &[Reading],
) -> SampleVariance {
    if late_squared == PerChannel::default() {
        return variance;
    }
    let Some(change) = change_per_second(k, stamps, readings) else {
        return variance;
    };
    let added =
        |channel, change: &Vector3<f64>| late_squared[channel] * change.norm_squared() / 3.0;
    SampleVariance {
        acceleration: variance.acceleration + added(Channel::Accelerometer, &change.specific_force),
        angular_velocity: variance.angular_velocity
            + added(Channel::Gyroscope, &change.angular_velocity),
        ..variance
    }
}

fn with_added(variance: SampleVariance, added: PerChannel<f64>) -> SampleVariance {
    SampleVariance {
        acceleration: variance.acceleration + added.accelerometer,
        angular_velocity: variance.angular_velocity + added.gyroscope,
        ..variance
    }
}
