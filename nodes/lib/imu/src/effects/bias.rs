//! `accel_bias`, `gyro_bias`: constant errors.

use super::EffectKind;
use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Rounding, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelBias,
    name: "accel_bias",
    stage: Stage::Linear,
    owner: Owner::Session,
    summary: "A constant is added to the specific force: the residual has a mean in sensor axes that does not turn with the segment.",
    remedy: "Calibrate the accelerometer at rest in six positions and subtract the bias.",
    parameters: &[ParameterSpec {
        name: "bias",
        unit: "m/s2",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -100.0,
        upper: 100.0,
        fit: Some(ParameterFit {
            step: 1e-5,
            prior_deviation: 2.0,
        }),
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(5e-3)),
        rounding: Some(Rounding::Offset),
        kept: Kept::AsCalibration,
        special_case_of: &[
            Dependence::Time,
            Dependence::Orientation,
            Dependence::OwnReading,
        ],
        identifiability: Some(Identifiability {
            relevant_size: 0.1,
            values: 3,
            would_tell: "turns of 60 degrees or more, or rest in several orientations",
        }),
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroBias,
    name: "gyro_bias",
    stage: Stage::Linear,
    owner: Owner::Session,
    summary: "A constant is added to the angular velocity: the residual has a mean, also at rest.",
    remedy: "Average the gyroscope at rest and subtract the mean.",
    parameters: &[ParameterSpec {
        name: "bias",
        unit: "rad/s",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -100.0,
        upper: 100.0,
        fit: Some(ParameterFit {
            step: 1e-6,
            prior_deviation: 0.3,
        }),
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(4e-4)),
        rounding: Some(Rounding::Offset),
        kept: Kept::AsCalibration,
        special_case_of: &[
            Dependence::Time,
            Dependence::Orientation,
            Dependence::OwnReading,
        ],
        identifiability: Some(Identifiability {
            relevant_size: 0.01,
            values: 3,
            would_tell: "any recording of some seconds",
        }),
    }),
};
