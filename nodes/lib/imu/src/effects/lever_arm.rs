//! `lever_arm`: the sensor sits beside the reference frame.

use nalgebra::Vector3;

use super::search::{FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::{EffectKind, EffectSet};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::LeverArm,
    name: "lever_arm",
    stage: Stage::Segment,
    owner: Owner::Device,
    summary: "The sensor sits away from the reference frame: the residual's specific force follows the square of the angular velocity and its derivative.",
    remedy: "Measure the sensor's position on its segment and enter it in the placement.",
    parameters: &[ParameterSpec {
        name: "offset",
        unit: "m",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -5.0,
        upper: 5.0,
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
        ordinary: Some(Ordinary::EachValue(1e-3)),
        rounding: None,
        kept: Kept::AsCalibration,
        special_case_of: &[],
        identifiability: Some(Identifiability {
            relevant_size: 0.02,
            values: 3,
            would_tell: "rotation about two axes with 2 rad/s or more",
        }),
    }),
};

/// `alpha x l + w x (w x l)`, m/s2, all in segment axes.
#[inline]
pub(super) fn acceleration(
    offset: &Vector3<f64>,
    angular_velocity: &Vector3<f64>,
    angular_acceleration: &Vector3<f64>,
) -> Vector3<f64> {
    angular_acceleration.cross(offset) + angular_velocity.cross(&angular_velocity.cross(offset))
}

impl EffectSet {
    /// From the reference frame to the sensor, in segment axes, m; zero without the effect.
    pub fn lever_arm(&self) -> Vector3<f64> {
        self.get(EffectKind::LeverArm)
            .map_or_else(Vector3::zeros, |effect| effect.vector(0))
    }
}
