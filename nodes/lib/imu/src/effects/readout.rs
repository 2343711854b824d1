//! Errors of one channel's readings: those that are linear, and those of its converter and driver.

use nalgebra::{Matrix3, Vector3};

use super::{EffectKind, EffectSet, misalignment, quantization, saturation};
use crate::Channel;

/// The last two stages of one channel: linear errors, and those of its converter and driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Readout {
    /// `diag(scale) (I + upper)`.
    matrix: Option<Matrix3<f64>>,
    bias: Vector3<f64>,
    /// Of the bias, per second since the epoch.
    drift: Vector3<f64>,
    /// White noise beyond the declared, (m/s2)/sqrt(Hz) or (rad/s)/sqrt(Hz).
    pub(super) density: f64,
    /// Range; infinite for none.
    limit: f64,
    /// Resolution; 0 for none.
    lsb: f64,
    /// Reported unit over SI unit.
    factor: f64,
}

impl Readout {
    pub(super) fn new(effects: &EffectSet, channel: Channel) -> Self {
        let [bias, scale, misaligned, noise, drift, limit, lsb, factor] = kinds(channel);
        let scalar = |kind: EffectKind| {
            effects
                .get(kind)
                .map_or(kind.spec().parameters[0].neutral[0], |effect| {
                    effect.scalar(0)
                })
        };
        let vector = |kind| effects.get(kind).map(|effect| effect.vector(0));
        let gains = vector(scale).map(|scale| Matrix3::from_diagonal(&scale));
        let cross = vector(misaligned).map(|upper| misalignment::matrix(&upper));
        let matrix = match (gains, cross) {
            (Some(gains), Some(cross)) => Some(gains * cross),
            (gains, cross) => gains.or(cross),
        };
        let [density, limit, lsb, factor] = [noise, limit, lsb, factor].map(scalar);
        Self {
            matrix,
            bias: vector(bias).unwrap_or_default(),
            drift: vector(drift).unwrap_or_default(),
            density,
            limit,
            lsb,
            factor,
        }
    }

    /// [`super::Stage::Linear`]: `diag(scale) (I + upper) x + bias + drift (t - t0)`.
    #[inline]
    pub(super) fn linear(&self, value: &Vector3<f64>, seconds: f64) -> Vector3<f64> {
        self.matrix.map_or(*value, |matrix| matrix * value) + self.bias + self.drift * seconds
    }

    /// [`super::Stage::Digital`], after the noise: clips, rounds, converts.
    #[inline]
    pub(super) fn digital(&self, value: &Vector3<f64>) -> Vector3<f64> {
        value.map(|value| {
            quantization::round(saturation::clip(value, self.limit), self.lsb) * self.factor
        })
    }
}

/// The effects of a channel's readings: bias, scale, misalignment, noise, drift of the bias,
/// saturation, quantisation and units.
fn kinds(channel: Channel) -> [EffectKind; 8] {
    use EffectKind as Kind;
    match channel {
        Channel::Accelerometer => [
            Kind::AccelBias,
            Kind::AccelScale,
            Kind::AccelMisalignment,
            Kind::AccelNoise,
            Kind::AccelBiasDrift,
            Kind::AccelSaturation,
            Kind::AccelQuantization,
            Kind::AccelUnits,
        ],
        Channel::Gyroscope => [
            Kind::GyroBias,
            Kind::GyroScale,
            Kind::GyroMisalignment,
            Kind::GyroNoise,
            Kind::GyroBiasDrift,
            Kind::GyroSaturation,
            Kind::GyroQuantization,
            Kind::GyroUnits,
        ],
    }
}
