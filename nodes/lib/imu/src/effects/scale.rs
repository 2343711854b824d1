//! `accel_scale`, `gyro_scale`: gain of each axis.

use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind, EffectSet};
use crate::Channel;

/// Gains beyond these are units, or gravity left out, but no scale.
const GAINS: std::ops::RangeInclusive<f64> = 0.5..=2.0;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelScale,
    name: "accel_scale",
    stage: Stage::Linear,
    owner: Owner::Device,
    summary: "The accelerometer's axes have gains: each axis' residual is proportional to what it reads.",
    remedy: "Calibrate the accelerometer's gains at rest in six positions.",
    parameters: &[ParameterSpec {
        name: "scale",
        unit: "",
        shape: Shape::Vector3,
        neutral: &[1.0; 3],
        is_optional: false,
        lower: 0.01,
        upper: 100.0,
        fit: Some(ParameterFit {
            step: 1e-5,
            prior_deviation: 0.3,
        }),
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible,
        ordinary: Some(Ordinary::EachValue(2e-3)),
        rounding: None,
        kept: Kept::BesideUnknown,
        special_case_of: &[Dependence::GainOverTime, Dependence::OwnReading],
        identifiability: Some(Identifiability {
            relevant_size: 0.03,
            values: 3,
            would_tell: "motion with 2 m/s2 or more on all axes, or rest with each axis up and down",
        }),
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroScale,
    name: "gyro_scale",
    stage: Stage::Linear,
    owner: Owner::Device,
    summary: "The gyroscope's axes have gains: each axis' residual is proportional to what it reads.",
    remedy: "Calibrate the gyroscope's gains on a turntable or by turns of a known angle.",
    parameters: &[ParameterSpec {
        name: "scale",
        unit: "",
        shape: Shape::Vector3,
        neutral: &[1.0; 3],
        is_optional: false,
        lower: 0.01,
        upper: 100.0,
        fit: Some(ParameterFit {
            step: 1e-5,
            prior_deviation: 0.3,
        }),
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible,
        ordinary: Some(Ordinary::EachValue(2e-3)),
        rounding: None,
        kept: Kept::BesideUnknown,
        special_case_of: &[Dependence::GainOverTime, Dependence::OwnReading],
        identifiability: Some(Identifiability {
            relevant_size: 0.03,
            values: 3,
            would_tell: "rotation with 1 rad/s or more about all axes",
        }),
    }),
};

fn is_plausible(effect: &Effect, _: &EffectSet) -> bool {
    effect.values().iter().all(|gain| GAINS.contains(gain))
}
