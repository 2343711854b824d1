//! `accel_quantization`, `gyro_quantization`: the resolution of a sensor.

use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{EffectKind, EffectSet};
use crate::{Channel, PerChannel};

/// The effect of each channel.
const KINDS: PerChannel<EffectKind> = PerChannel {
    accelerometer: EffectKind::AccelQuantization,
    gyroscope: EffectKind::GyroQuantization,
};

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelQuantization,
    name: "accel_quantization",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The accelerometer rounds to steps: all readings lie on a lattice, and the residual is as wide as a step.",
    remedy: "Choose a smaller range or a device with more bits.",
    parameters: &[ParameterSpec {
        name: "lsb",
        unit: "m/s2",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: 0.0,
        upper: 1e6,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::Lattice(Channel::Accelerometer),
        probability: 0.98,
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroQuantization,
    name: "gyro_quantization",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The gyroscope rounds to steps: all readings lie on a lattice, and the residual is as wide as a step.",
    remedy: "Choose a smaller range or a device with more bits.",
    parameters: &[ParameterSpec {
        name: "lsb",
        unit: "rad/s",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: 0.0,
        upper: 1e6,
        fit: None,
    }],
    channels: &[Channel::Gyroscope],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::Lattice(Channel::Gyroscope),
        probability: 0.98,
    }),
};

/// Spacing of the lattice through zero that all values lie on, where there is one: the greatest
/// common divisor of the sorted values' differences, found by Euclid's steps down to 1e-7 of the
/// largest value. Reorders the values.
pub fn lattice_spacing(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let largest = values.first()?.abs().max(values.last()?.abs());
    let least = largest * 1e-7;
    let differences = || {
        values
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .filter(|difference| *difference > 1e-3 * least)
    };
    let mut spacing = differences().fold(f64::INFINITY, f64::min);
    for difference in differences() {
        let mut rest = (difference - (difference / spacing).round() * spacing).abs();
        // Rounding of the readings themselves and of the spacing found so far.
        let tolerance = 1e-13 * largest + 1e-6 * spacing;
        let mut larger = spacing;
        while rest > tolerance {
            (larger, rest) = (rest, (larger - (larger / rest).round() * rest).abs());
        }
        spacing = larger;
        if spacing < least {
            return None;
        }
    }
    if !spacing.is_finite() {
        return None;
    }
    // The whole range fixes the spacing better than one difference.
    let steps = (largest / spacing).round();
    let spacing = largest / steps.max(1.0);
    values
        .iter()
        .all(|value| (value / spacing - (value / spacing).round()).abs() < 1e-3)
        .then_some(spacing)
}

/// Rounds to the nearest multiple of lsb.
#[inline]
pub(super) fn round(value: f64, lsb: f64) -> f64 {
    if lsb > 0.0 {
        (value / lsb).round() * lsb
    } else {
        value
    }
}

impl EffectSet {
    /// Step of a channel's rounding, m/s2 or rad/s; 0 without the effect.
    pub fn lsb(&self, channel: Channel) -> f64 {
        self.get(KINDS[channel])
            .map_or(0.0, |effect| effect.scalar(0))
    }
}
