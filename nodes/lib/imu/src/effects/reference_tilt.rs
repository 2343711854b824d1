//! `reference_tilt`: the reference's world is not level.

use std::f64::consts::PI;

use cromosim_spatial::so3;
use nalgebra::Vector3;

use super::EffectKind;
use super::search::{FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use crate::{Channel, GRAVITY_IN_WORLD};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceTilt,
    name: "reference_tilt",
    stage: Stage::Reference,
    owner: Owner::Session,
    summary: "The reference's vertical is not gravity's: the residual's specific force is constant in the world and turns with the segment.",
    remedy: "Level the motion capture's world, or turn the reference by the inverse of this rotation.",
    parameters: &[ParameterSpec {
        name: "rotvec",
        unit: "rad",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -PI,
        upper: PI,
        fit: Some(ParameterFit {
            step: 1e-5,
            prior_deviation: 0.3,
        }),
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(2e-3)),
        rounding: None,
        kept: Kept::Never,
        special_case_of: &[],
        identifiability: Some(Identifiability {
            relevant_size: 0.035,
            values: 2,
            would_tell: "turns of 60 degrees or more about two axes, so that tilt and mount differ",
        }),
    }),
};

/// Gravity in the reported world, m/s2: `T g`, with T reported world from true world.
pub(super) fn gravity(rotvec: &Vector3<f64>) -> Vector3<f64> {
    so3::exp(rotvec) * GRAVITY_IN_WORLD
}
