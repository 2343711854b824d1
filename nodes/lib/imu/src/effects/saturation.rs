//! `accel_saturation`, `gyro_saturation`: the range of a sensor.

use super::EffectKind;
use super::spec::{EffectSpec, ParameterSpec, ResidualView, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelSaturation,
    name: "accel_saturation",
    stage: Stage::Digital,
    summary: "The accelerometer clips: the residual appears where the simulated force exceeds the limit, and the readings stand still at it.",
    remedy: "Choose a larger range (g setting) of the accelerometer.",
    parameters: &[ParameterSpec {
        name: "limit",
        unit: "m/s2",
        shape: Shape::Scalar,
        neutral: &[1e9],
        lower: 1e-9,
        upper: 1e9,
        step: 1e-3,
    }],
    random: false,
    continuous: false,
    starts: |view| starts(view, Channel::Accelerometer),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroSaturation,
    name: "gyro_saturation",
    stage: Stage::Digital,
    summary: "The gyroscope clips: the residual appears where the simulated rate exceeds the limit, and the readings stand still at it.",
    remedy: "Choose a larger range (deg/s setting) of the gyroscope.",
    parameters: &[ParameterSpec {
        name: "limit",
        unit: "rad/s",
        shape: Shape::Scalar,
        neutral: &[1e9],
        lower: 1e-9,
        upper: 1e9,
        step: 1e-3,
    }],
    random: false,
    continuous: false,
    starts: |view| starts(view, Channel::Gyroscope),
};

/// Readings at the limit that make it one.
const LEAST_REPEATS: usize = 3;

/// The largest magnitude on any axis, where it repeats and the simulation mostly reads as much or
/// more there.
fn starts(view: &ResidualView, channel: Channel) -> Vec<Vec<f64>> {
    let values = || {
        view.pairs(channel)
            .flat_map(|(m, s)| (0..3).map(move |axis| (m[axis], s[axis])))
    };
    let limit = values().map(|(m, _)| m.abs()).fold(0.0, f64::max);
    let at_limit = || values().filter(|(m, _)| m.abs() >= limit * (1.0 - 1e-9));
    let repeats = at_limit().count();
    let beyond = at_limit()
        .filter(|(m, s)| s * m.signum() >= 0.9 * limit)
        .count();
    let found = limit > 0.0 && repeats >= LEAST_REPEATS && 2 * beyond >= repeats;
    vec![vec![if found {
        limit
    } else {
        ACCEL.parameters[0].neutral[0]
    }]]
}

/// Clips one value at +-limit.
#[inline]
pub(super) fn clip(value: f64, limit: f64) -> f64 {
    value.clamp(-limit, limit)
}
