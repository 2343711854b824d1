//! `reference_noise`: scatter of the reported pose; it belongs to the recording and no simulation
//! takes it away.

use std::f64::consts::PI;

use super::EffectKind;
use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceNoise,
    name: "reference_noise",
    stage: Stage::Reference,
    owner: Owner::Session,
    summary: "The reference pose scatters from sample to sample; differentiated, the scatter leaves broadband residual in both channels.",
    remedy: "Improve the motion capture: more cameras in view, larger marker spacing, or smooth the reference before use.",
    parameters: &[
        ParameterSpec {
            name: "position",
            unit: "m",
            shape: Shape::Scalar,
            neutral: &[0.0],
            is_optional: false,
            lower: 0.0,
            upper: 1.0,
            fit: None,
        },
        ParameterSpec {
            name: "rotation",
            unit: "rad",
            shape: Shape::Scalar,
            neutral: &[0.0],
            is_optional: false,
            lower: 0.0,
            upper: PI,
            fit: None,
        },
    ],
    channels: &Channel::ALL,
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ReferenceScatter,
        probability: 0.95,
    }),
};
