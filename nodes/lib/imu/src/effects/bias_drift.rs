//! `accel_bias_drift`, `gyro_bias_drift`: biases that grow with time.

use super::EffectKind;
use super::search::{
    Dependence, FirstGuess, FittedSearch, Kept, Ordinary, Rounding, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelBiasDrift,
    name: "accel_bias_drift",
    stage: Stage::Linear,
    owner: Owner::Session,
    summary: "The accelerometer's bias grows with time: the residual's mean is a ramp that is zero at the epoch.",
    remedy: "Let the device warm up, compensate for temperature, or calibrate again during the session.",
    parameters: &[ParameterSpec {
        name: "rate",
        unit: "m/s3",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -10.0,
        upper: 10.0,
        fit: Some(ParameterFit {
            step: 1e-6,
            prior_deviation: 0.05,
        }),
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(2e-4)),
        rounding: Some(Rounding::Ramp),
        kept: Kept::Never,
        special_case_of: &[Dependence::Time],
        identifiability: None,
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroBiasDrift,
    name: "gyro_bias_drift",
    stage: Stage::Linear,
    owner: Owner::Session,
    summary: "The gyroscope's bias grows with time: the residual's mean is a ramp that is zero at the epoch.",
    remedy: "Let the device warm up, compensate for temperature, or average the gyroscope at rest again during the session.",
    parameters: &[ParameterSpec {
        name: "rate",
        unit: "rad/s2",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -10.0,
        upper: 10.0,
        fit: Some(ParameterFit {
            step: 1e-7,
            prior_deviation: 0.005,
        }),
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(1.5e-5)),
        rounding: Some(Rounding::Ramp),
        kept: Kept::Never,
        special_case_of: &[Dependence::Time],
        identifiability: None,
    }),
};
