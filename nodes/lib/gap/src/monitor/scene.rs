//! One window: both streams, what they are compared with, and what is taken for noise.

use cromosim_imu::PerChannel;

use super::pairs::Pairs;
use super::reading::{ImuReading, noise_floors};
use crate::axes::sum_over_channels;

/// What the monitor takes for noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitorOptions {
    /// White noise of a measured reading as the device declares it, m/s2 and rad/s; none where
    /// unknown: then the noise that is found counts as declared.
    pub declared_sigmas: PerChannel<Option<f64>>,
    /// What the reference is trusted to, m/s2 and rad/s: the noise floor is never taken to be
    /// lower.
    pub least_sigmas: PerChannel<f64>,
    /// How far lags are looked for, s.
    pub largest_lag_s: f64,
}

impl Default for MonitorOptions {
    fn default() -> Self {
        Self {
            declared_sigmas: PerChannel::default(),
            least_sigmas: PerChannel {
                accelerometer: 0.02,
                gyroscope: 0.002,
            },
            largest_lag_s: 0.3,
        }
    }
}

/// What a window offers to the candidates.
pub(super) struct Scene<'a> {
    pub measured: &'a [ImuReading],
    pub simulated: &'a [ImuReading],
    /// Without a lag.
    pub pairs: &'a Pairs,
    /// Noise that residuals are divided by, m/s2 and rad/s.
    pub sigmas: PerChannel<f64>,
    /// White noise found in the measured stream.
    pub found: PerChannel<f64>,
    /// White noise declared for it.
    pub declared: PerChannel<f64>,
    pub largest_lag_s: f64,
}

impl<'a> Scene<'a> {
    pub(super) fn new(
        measured: &'a [ImuReading],
        simulated: &'a [ImuReading],
        pairs: &'a Pairs,
        options: &MonitorOptions,
    ) -> Self {
        let found = noise_floors(measured);
        let of_simulation = noise_floors(simulated);
        let declared = PerChannel::from_fn(|channel| {
            options.declared_sigmas[channel].unwrap_or(found[channel])
        });
        let sigmas = PerChannel::from_fn(|channel| {
            // Of a simulated noise, interpolation leaves only a part.
            declared[channel]
                .hypot(of_simulation[channel] * pairs.noise_gain)
                .max(options.least_sigmas[channel])
        });
        Self {
            measured,
            simulated,
            pairs,
            sigmas,
            found,
            declared,
            largest_lag_s: options.largest_lag_s,
        }
    }

    /// Squared residual of pairs, in units of the noise.
    pub(super) fn whitened(&self, pairs: &Pairs) -> f64 {
        let sums = pairs.squared_residuals();
        sum_over_channels(|channel| sums[channel] / self.sigmas[channel].powi(2))
    }
}
