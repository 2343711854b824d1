//! What an effect's first guess looks at.

use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use crate::{Channel, Reading};

/// What was measured and what is simulated so far, at the same stamps.
#[derive(Clone, Copy, Debug)]
pub struct ResidualView<'a> {
    /// Stamps of the IMU's messages, by its own clock.
    pub stamps: &'a [Stamp],
    /// t0.
    pub epoch: Stamp,
    /// Rate of the messages, Hz.
    pub rate_hz: f64,
    /// What the device read.
    pub measured: &'a [Reading],
    /// What the model reads so far.
    pub simulated: &'a [Reading],
}

impl ResidualView<'_> {
    /// Measured less simulated.
    pub(super) fn residual(&self, channel: Channel) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.measured
            .iter()
            .zip(self.simulated)
            .take(self.stamps.len())
            .map(move |(m, s)| m[channel] - s[channel])
    }
}

/// Median; 0 of nothing. Reorders.
pub(super) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
