//! `reference_scale`: positions of the reference that are a little too large or too small.

use super::search::{FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind, EffectSet};
use crate::Channel;

/// Distance from 1 that every reference has.
const ORDINARY: f64 = 6e-3;
/// Factors beyond these are units, or gravity left out, but no scale.
const SCALES: std::ops::RangeInclusive<f64> = 0.5..=2.0;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceScale,
    name: "reference_scale",
    stage: Stage::Reference,
    owner: Owner::Session,
    summary: "Positions of the reference are too large or too small: the residual's specific force is proportional to the acceleration, gravity left out.",
    remedy: "Calibrate the motion capture's scale, or divide the reference's positions by this factor.",
    parameters: &[ParameterSpec {
        name: "factor",
        unit: "",
        shape: Shape::Scalar,
        neutral: &[1.0],
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
        ordinary: Some(Ordinary::EachValue(ORDINARY)),
        rounding: None,
        kept: Kept::Never,
        special_case_of: &[],
        identifiability: Some(Identifiability {
            relevant_size: 0.03,
            values: 1,
            would_tell: "motion with accelerations of 2 m/s2 or more",
        }),
    }),
};

fn is_plausible(effect: &Effect, _: &EffectSet) -> bool {
    let factor = effect.scalar(0);
    SCALES.contains(&factor) && (factor - 1.0).abs() > ORDINARY
}
