//! `accel_bias_instability`, `gyro_bias_instability`: a bias that wanders about its mean and forgets
//! where it was, a first-order Gauss-Markov process of each axis (IEEE Std 952, annex C: "exponentially
//! correlated (Markov) noise"). Its autocorrelation is `deviation^2 exp(-|t| / time_constant)`, its
//! Allan deviation at most 0.618 `deviation`, at 1.89 time constants, where a data sheet's curve has its
//! floor.

use super::EffectKind;
use super::search::Search;
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelBiasInstability,
    name: "accel_bias_instability",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The accelerometer bias wanders about its mean: the residual has slow parts at rest, the Allan deviation a floor.",
    remedy: "Estimate the bias on the way with a filter that lets it wander, or use a device of lower bias instability.",
    parameters: &[
        ParameterSpec {
            name: "deviation",
            unit: "m/s2",
            shape: Shape::Scalar,
            neutral: &[0.0],
            is_optional: false,
            lower: 0.0,
            upper: 100.0,
            fit: None,
        },
        ParameterSpec {
            name: "time_constant",
            unit: "s",
            shape: Shape::Scalar,
            neutral: &[100.0],
            is_optional: false,
            lower: 1e-3,
            upper: 1e9,
            fit: None,
        },
    ],
    channels: &[Channel::Accelerometer],
    search: Search::Given,
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroBiasInstability,
    name: "gyro_bias_instability",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The gyroscope bias wanders about its mean: the residual has slow parts at rest, the Allan deviation a floor.",
    remedy: "Estimate the bias on the way with a filter that lets it wander, or use a device of lower bias instability.",
    parameters: &[
        ParameterSpec {
            name: "deviation",
            unit: "rad/s",
            shape: Shape::Scalar,
            neutral: &[0.0],
            is_optional: false,
            lower: 0.0,
            upper: 100.0,
            fit: None,
        },
        ParameterSpec {
            name: "time_constant",
            unit: "s",
            shape: Shape::Scalar,
            neutral: &[100.0],
            is_optional: false,
            lower: 1e-3,
            upper: 1e9,
            fit: None,
        },
    ],
    channels: &[Channel::Gyroscope],
    search: Search::Given,
};
