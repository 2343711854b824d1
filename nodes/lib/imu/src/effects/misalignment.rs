//! `accel_misalignment`, `gyro_misalignment`: axes that are not orthogonal.

use nalgebra::{Matrix3, Vector3};

use super::EffectKind;
use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static ACCEL: EffectSpec = EffectSpec {
    kind: EffectKind::AccelMisalignment,
    name: "accel_misalignment",
    stage: Stage::Linear,
    owner: Owner::Device,
    summary: "The accelerometer's axes are not orthogonal: an axis' residual is proportional to what its neighbours read.",
    remedy: "Calibrate the accelerometer's cross-axis terms at rest in many positions.",
    parameters: &[ParameterSpec {
        name: "upper",
        unit: "",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -1.0,
        upper: 1.0,
        fit: Some(ParameterFit {
            step: 1e-5,
            prior_deviation: 0.2,
        }),
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(3e-3)),
        rounding: None,
        kept: Kept::BesideUnknown,
        special_case_of: &[Dependence::MountOverTime, Dependence::OtherAxes],
        identifiability: Some(Identifiability {
            relevant_size: 0.03,
            values: 3,
            would_tell: "motion with 2 m/s2 or more on all axes, or rest in several orientations",
        }),
    }),
};

pub(super) static GYRO: EffectSpec = EffectSpec {
    kind: EffectKind::GyroMisalignment,
    name: "gyro_misalignment",
    stage: Stage::Linear,
    owner: Owner::Device,
    summary: "The gyroscope's axes are not orthogonal: an axis' residual is proportional to what its neighbours read.",
    remedy: "Calibrate the gyroscope's cross-axis terms on a turntable.",
    parameters: &[ParameterSpec {
        name: "upper",
        unit: "",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -1.0,
        upper: 1.0,
        fit: Some(ParameterFit {
            step: 1e-5,
            prior_deviation: 0.2,
        }),
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(3e-3)),
        rounding: None,
        kept: Kept::BesideUnknown,
        special_case_of: &[Dependence::MountOverTime, Dependence::OtherAxes],
        identifiability: Some(Identifiability {
            relevant_size: 0.03,
            values: 3,
            would_tell: "rotation with 1 rad/s or more about all axes",
        }),
    }),
};

/// `I + upper` from the cross terms xy, xz, yz.
pub(super) fn matrix(upper: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(1.0, upper.x, upper.y, 0.0, 1.0, upper.z, 0.0, 0.0, 1.0)
}
