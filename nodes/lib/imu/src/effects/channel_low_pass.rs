//! `accel_low_pass`, `gyro_low_pass`: a channel's own second-order Butterworth filter, in place of
//! `low_pass`.

use super::EffectKind;
use super::search::Search;
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelLowPass,
    name: "accel_low_pass",
    stage: Stage::Sensor,
    owner: Owner::Device,
    summary: "The accelerometer has a filter of its own: its fast motion is weaker and comes late by 0.225 / cutoff_hz; a diagnosis names low_pass and channel_delay.",
    remedy: "Raise the bandwidth setting of the accelerometer, or put the same filter into the simulation.",
    parameters: &[ParameterSpec {
        name: "cutoff_hz",
        unit: "Hz",
        shape: Shape::Scalar,
        neutral: &[1e4],
        is_optional: false,
        lower: 0.1,
        upper: 1e4,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Given,
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroLowPass,
    name: "gyro_low_pass",
    stage: Stage::Sensor,
    owner: Owner::Device,
    summary: "The gyroscope has a filter of its own: its fast motion is weaker and comes late by 0.225 / cutoff_hz; a diagnosis names low_pass and channel_delay.",
    remedy: "Raise the bandwidth setting of the gyroscope, or put the same filter into the simulation.",
    parameters: &[ParameterSpec {
        name: "cutoff_hz",
        unit: "Hz",
        shape: Shape::Scalar,
        neutral: &[1e4],
        is_optional: false,
        lower: 0.1,
        upper: 1e4,
        fit: None,
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Given,
};
