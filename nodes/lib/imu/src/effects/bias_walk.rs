//! `accel_bias_walk`, `gyro_bias_walk`: a bias that walks at random from where it begins (rate random
//! walk, IEEE Std 952, annex C): its variance is `density^2 t`, its Allan variance `density^2 tau / 3`.

use super::EffectKind;
use super::search::Search;
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelBiasWalk,
    name: "accel_bias_walk",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The accelerometer bias walks away at random: the longer the recording, the larger the slow parts of the residual.",
    remedy: "Estimate the bias on the way, or calibrate again during the session.",
    parameters: &[ParameterSpec {
        name: "density",
        unit: "(m/s3)/sqrt(Hz)",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: 0.0,
        upper: 100.0,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Given,
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroBiasWalk,
    name: "gyro_bias_walk",
    stage: Stage::Digital,
    owner: Owner::Device,
    summary: "The gyroscope bias walks away at random: the longer the recording, the larger the slow parts of the residual.",
    remedy: "Estimate the bias on the way, or average the gyroscope at rest again during the session.",
    parameters: &[ParameterSpec {
        name: "density",
        unit: "(rad/s2)/sqrt(Hz)",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: 0.0,
        upper: 100.0,
        fit: None,
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Given,
};
