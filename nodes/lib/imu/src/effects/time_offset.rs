//! `time_offset`: the IMU's stamps are late by a constant.

use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind, EffectSet};
use crate::{Channel, EffectError};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::TimeOffset,
    name: "time_offset",
    stage: Stage::Timing,
    owner: Owner::Session,
    summary: "The IMU's stamps are late (positive) or early: the residual of both channels is proportional to their time derivative.",
    remedy: "Synchronise the clocks (hardware trigger, PTP), or shift the IMU's stamps by this offset.",
    parameters: &[ParameterSpec {
        name: "seconds",
        unit: "s",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: -10.0,
        upper: 10.0,
        fit: Some(ParameterFit {
            step: 1e-5,
            prior_deviation: 1.0,
        }),
    }],
    channels: &Channel::ALL,
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(2e-3)),
        rounding: None,
        kept: Kept::AsCalibration,
        special_case_of: &[Dependence::DelayOverTime],
        identifiability: Some(Identifiability {
            relevant_size: 0.01,
            values: 1,
            would_tell: "motion with changing angular velocity, 1 rad/s or more",
        }),
    }),
};

impl Effect {
    /// Stamps late by so many seconds.
    ///
    /// # Errors
    /// [`EffectError`] for an offset out of bounds.
    pub fn time_offset(seconds: f64) -> Result<Self, EffectError> {
        SPEC.effect(vec![seconds])
    }
}

impl EffectSet {
    /// How late the stamps are, s; 0 without the effect.
    pub fn time_offset(&self) -> f64 {
        self.get(EffectKind::TimeOffset)
            .map_or(0.0, |effect| effect.scalar(0))
    }
}
