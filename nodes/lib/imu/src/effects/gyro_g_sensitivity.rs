//! `gyro_g_sensitivity`: the gyroscope feels specific force, `w += G f`.

use super::EffectKind;
use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::GyroGSensitivity,
    name: "gyro_g_sensitivity",
    stage: Stage::Sensor,
    owner: Owner::Device,
    summary: "The gyroscope feels specific force: its residual is linear in the force, gravity included, so that it turns with the sensor.",
    remedy: "Calibrate the gyroscope at rest in six positions, or damp shocks at the mount.",
    parameters: &[ParameterSpec {
        name: "matrix",
        unit: "(rad/s)/(m/s2)",
        shape: Shape::Matrix3,
        neutral: &[0.0; 9],
        is_optional: false,
        lower: -10.0,
        upper: 10.0,
        fit: Some(ParameterFit {
            step: 1e-6,
            prior_deviation: 0.02,
        }),
    }],
    channels: &[Channel::Gyroscope],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(5e-5)),
        rounding: None,
        kept: Kept::Never,
        special_case_of: &[Dependence::Orientation],
        identifiability: Some(Identifiability {
            relevant_size: 0.002,
            values: 9,
            would_tell: "strong acceleration without rotation, on all axes",
        }),
    }),
};
