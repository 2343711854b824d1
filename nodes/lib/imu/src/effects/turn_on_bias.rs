//! `accel_turn_on_bias`, `gyro_turn_on_bias`: a constant error that is another one each time that the
//! device is switched on, drawn from a normal distribution of this standard deviation about each axis.

use super::EffectKind;
use super::search::Search;
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelTurnOnBias,
    name: "accel_turn_on_bias",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "Each run begins with another accelerometer bias: within one recording it is a constant, which a diagnosis names accel_bias.",
    remedy: "Calibrate the accelerometer at rest in six positions after it is switched on.",
    parameters: &[ParameterSpec {
        name: "deviation",
        unit: "m/s2",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: 0.0,
        upper: 100.0,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Given,
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroTurnOnBias,
    name: "gyro_turn_on_bias",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "Each run begins with another gyroscope bias: within one recording it is a constant, which a diagnosis names gyro_bias.",
    remedy: "Average the gyroscope at rest after it is switched on, and subtract the mean.",
    parameters: &[ParameterSpec {
        name: "deviation",
        unit: "rad/s",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: 0.0,
        upper: 100.0,
        fit: None,
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Given,
};
