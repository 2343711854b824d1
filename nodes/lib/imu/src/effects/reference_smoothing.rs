//! `reference_smoothing`: a reference that was low-passed without phase; what is lost there no
//! simulation brings back.

use super::EffectKind;
use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceSmoothing,
    name: "reference_smoothing",
    stage: Stage::Reference,
    owner: Owner::Session,
    summary: "The reference was smoothed: fast motion that the IMU feels is missing from it, in step with the motion and above the cutoff.",
    remedy: "Export the motion capture unfiltered, or with a higher cutoff frequency.",
    parameters: &[ParameterSpec {
        name: "cutoff_hz",
        unit: "Hz",
        shape: Shape::Scalar,
        neutral: &[1e4],
        lower: 0.1,
        upper: 1e4,
        fit: None,
    }],
    channels: &Channel::ALL,
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ReferenceSpectrum,
        probability: 0.9,
    }),
};
