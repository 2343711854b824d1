//! `accel_noise`, `gyro_noise`: white noise beyond the declared.

use super::residual_view::median;
use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{EffectKind, EffectSet};
use crate::{Channel, PerChannel, Reading};

/// The effect of each channel.
const KINDS: PerChannel<EffectKind> = PerChannel {
    accelerometer: EffectKind::AccelNoise,
    gyroscope: EffectKind::GyroNoise,
};

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelNoise,
    name: "accel_noise",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The accelerometer scatters more than declared: white residual that no motion explains.",
    remedy: "State the true noise in the device file and the covariances, or use a quieter device or mode.",
    parameters: &[ParameterSpec {
        name: "density",
        unit: "(m/s2)/sqrt(Hz)",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: 0.0,
        upper: 100.0,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ExcessNoise(Channel::Accelerometer),
        probability: 0.95,
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroNoise,
    name: "gyro_noise",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The gyroscope scatters more than declared: white residual that no motion explains.",
    remedy: "State the true noise in the device file and the covariances, or use a quieter device or mode.",
    parameters: &[ParameterSpec {
        name: "density",
        unit: "(rad/s)/sqrt(Hz)",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: 0.0,
        upper: 100.0,
        fit: None,
    }],
    channels: &[Channel::Gyroscope],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ExcessNoise(Channel::Gyroscope),
        probability: 0.95,
    }),
};

/// Density of the white noise of readings at rest, from the median of their third differences so
/// that smooth motion and outliers count little: (m/s2)/sqrt(Hz) or (rad/s)/sqrt(Hz).
pub fn white_noise_density(readings: &[Reading], channel: Channel, rate_hz: f64) -> f64 {
    let third =
        |w: &[Reading]| w[3][channel] - w[2][channel] * 3.0 + w[1][channel] * 3.0 - w[0][channel];
    let mut differences: Vec<f64> = readings
        .windows(4)
        .flat_map(|w| <[f64; 3]>::from(third(w).abs()))
        .collect();
    // 1 + 9 + 9 + 1 = 20 variances; the median of |x| is 0.6745 sigma.
    let sigma = median(&mut differences) / 0.674_489_750_196_081_7 / 20f64.sqrt();
    (sigma.powi(2) / rate_hz.max(1e-9)).sqrt()
}

impl EffectSet {
    /// Density of a channel's white noise beyond the declared; 0 without the effect.
    pub fn noise_density(&self, channel: Channel) -> f64 {
        self.get(KINDS[channel])
            .map_or(0.0, |effect| effect.scalar(0))
    }
}
