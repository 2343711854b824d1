//! `reference_interpolation`: poses on straight chords between frames of a lower rate; between the
//! frames nothing was seen.

use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{EffectKind, EffectSet};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceInterpolation,
    name: "reference_interpolation",
    stage: Stage::Reference,
    owner: Owner::Session,
    summary: "The reference was interpolated along straight lines between frames of a lower rate: its velocities jump at each frame, and its accelerations are spikes.",
    remedy: "Export the motion capture at its own rate, or keep only the frames of this rate.",
    parameters: &[ParameterSpec {
        name: "rate_hz",
        unit: "Hz",
        shape: Shape::Scalar,
        neutral: &[1e5],
        is_optional: false,
        lower: 0.1,
        upper: 1e5,
        fit: None,
    }],
    channels: &Channel::ALL,
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ReferenceFrames,
        probability: 0.95,
    }),
};

impl EffectSet {
    /// Rate of the frames between which the reference was interpolated, Hz; none without the effect.
    pub fn frame_rate_hz(&self) -> Option<f64> {
        self.get(EffectKind::ReferenceInterpolation)
            .map(|effect| effect.scalar(0))
    }
}
