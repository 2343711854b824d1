//! `mount_rotation`: the sensor is turned on its segment.

use std::f64::consts::PI;

use cromosim_spatial::so3;
use nalgebra::{Matrix3, Vector3};

use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind};
use crate::{Channel, EffectError};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::MountRotation,
    name: "mount_rotation",
    stage: Stage::Sensor,
    owner: Owner::Device,
    summary: "The sensor's axes are turned against the reference frame's: both channels are the simulated vectors in other axes.",
    remedy: "Calibrate the sensor-to-segment rotation and enter it as the placement's mount.",
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
            prior_deviation: 2.0,
        }),
    }],
    channels: &Channel::ALL,
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(3e-3)),
        rounding: None,
        kept: Kept::AsCalibration,
        special_case_of: &[Dependence::MountOverTime],
        identifiability: Some(Identifiability {
            relevant_size: 0.035,
            values: 3,
            would_tell: "turns of 30 degrees or more about two axes",
        }),
    }),
};

/// `R_mount^T`, which turns segment axes into sensor axes; R_mount is segment_from_sensor.
pub(super) fn sensor_from_segment(rotvec: &Vector3<f64>) -> Matrix3<f64> {
    so3::exp(rotvec)
        .to_rotation_matrix()
        .into_inner()
        .transpose()
}

impl Effect {
    /// A sensor turned by a rotation vector, rad: segment_from_sensor.
    ///
    /// # Errors
    /// [`EffectError`] for one with an entry beyond pi.
    pub fn mount_rotation(rotvec: &Vector3<f64>) -> Result<Self, EffectError> {
        SPEC.effect(rotvec.as_slice().to_vec())
    }
}
