//! `accel_saturation`, `gyro_saturation`: the range of a sensor.

use super::EffectKind;
use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelSaturation,
    name: "accel_saturation",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The accelerometer clips: the residual appears where the simulated force exceeds the limit, and the readings stand still at it.",
    remedy: "Choose a larger range (g setting) of the accelerometer.",
    parameters: &[ParameterSpec {
        name: "limit",
        unit: "m/s2",
        shape: Shape::Scalar,
        neutral: &[1e9],
        is_optional: false,
        lower: 1e-9,
        upper: 1e9,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ClippedReadings(Channel::Accelerometer),
        probability: 0.98,
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroSaturation,
    name: "gyro_saturation",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The gyroscope clips: the residual appears where the simulated rate exceeds the limit, and the readings stand still at it.",
    remedy: "Choose a larger range (deg/s setting) of the gyroscope.",
    parameters: &[ParameterSpec {
        name: "limit",
        unit: "rad/s",
        shape: Shape::Scalar,
        neutral: &[1e9],
        is_optional: false,
        lower: 1e-9,
        upper: 1e9,
        fit: None,
    }],
    channels: &[Channel::Gyroscope],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ClippedReadings(Channel::Gyroscope),
        probability: 0.98,
    }),
};

/// Values at the largest magnitude that make it a limit.
const LEAST_REPEATS: usize = 4;
/// The same of values on a lattice, whose tail thins out from step to step.
const LEAST_REPEATS_ON_LATTICE: usize = 12;
/// Values at the limit, in units of those one step of the lattice below.
const MORE_THAN_BELOW: usize = 3;
/// Separate times at the limit, as a slow peak dwells on one step of a lattice.
const LEAST_EPISODES: usize = 3;
/// Values without the limit that separate two times at it: twenty readings.
const EPISODE_GAP: usize = 60;

/// A value at which readings clip or may clip, in the unit of the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClippingLimit {
    /// Of largest magnitude, positive.
    pub value: f64,
    /// Whether the readings alone show it; else peaks of the motion may have made it, and a simulation tells.
    pub is_certain: bool,
}

/// The value at which the readings of a channel clip; none where they do not. `values` are those of
/// all axes, reading after reading; `lsb` is the lattice that they lie on, where there is one: then
/// more than three times as many readings at the largest value as one step below make a limit certain,
/// and fewer, but more than one step below, leave it open.
pub fn clipping_limit(values: &[f64], lsb: Option<f64>) -> Option<ClippingLimit> {
    let largest = values
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    let clipped: Vec<usize> = values
        .iter()
        .enumerate()
        .filter(|(_, value)| value.abs() >= largest * (1.0 - 1e-9))
        .map(|(at, _)| at)
        .collect();
    let repeats = clipped.len();
    let (may_clip, is_certain) = if let Some(lsb) = lsb {
        let below = values
            .iter()
            .filter(|value| (value.abs() - largest + lsb).abs() < 0.5 * lsb)
            .count();
        let episodes = 1 + clipped
            .windows(2)
            .filter(|pair| pair[1] > pair[0] + EPISODE_GAP)
            .count();
        let piles_up = repeats >= LEAST_REPEATS_ON_LATTICE && episodes >= LEAST_EPISODES;
        (
            piles_up && repeats > below,
            repeats > MORE_THAN_BELOW * below,
        )
    } else {
        (repeats >= LEAST_REPEATS, true)
    };
    (may_clip && largest > 0.0).then_some(ClippingLimit {
        value: largest,
        is_certain,
    })
}

/// Clips one value at +-limit.
#[inline]
pub(super) fn clip(value: f64, limit: f64) -> f64 {
    value.clamp(-limit, limit)
}
