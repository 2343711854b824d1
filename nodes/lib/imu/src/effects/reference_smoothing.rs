//! `reference_smoothing`: a reference that was low-passed without phase; what is lost there no
//! simulation brings back.

use cromosim_spatial::{SmoothingKernel, ZeroPhaseSmoothing};

use super::low_pass::CUTOFF;
use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind, EffectSet};
use crate::{Channel, EffectError};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceSmoothing,
    name: "reference_smoothing",
    stage: Stage::Reference,
    owner: Owner::Session,
    summary: "The reference was smoothed: fast motion that the IMU feels is missing from it, in step with the motion and above the cutoff.",
    remedy: "Export the motion capture unfiltered, or with a higher cutoff frequency.",
    parameters: &[
        CUTOFF,
        ParameterSpec {
            name: "kernel",
            unit: "",
            shape: Shape::Choice(&[
                "butterworth",
                "gaussian",
                "butterworth_1",
                "butterworth_3",
                "butterworth_4",
            ]),
            neutral: &[0.0],
            is_optional: true,
            lower: 0.0,
            upper: 4.0,
            fit: None,
        },
    ],
    channels: &Channel::ALL,
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ReferenceSpectrum,
        probability: 0.9,
    }),
};

/// The kernels in the order of the parameter's words.
const KERNELS: [SmoothingKernel; 5] = [
    SmoothingKernel::SECOND_ORDER,
    SmoothingKernel::Gaussian,
    SmoothingKernel::Butterworth { order: 1 },
    SmoothingKernel::Butterworth { order: 3 },
    SmoothingKernel::Butterworth { order: 4 },
];

impl Effect {
    /// A reference that was smoothed in this way.
    ///
    /// # Errors
    /// [`EffectError`] for a cutoff out of bounds.
    pub fn reference_smoothing(smoothing: &ZeroPhaseSmoothing) -> Result<Self, EffectError> {
        let kernel = KERNELS.iter().position(|own| *own == smoothing.kernel);
        SPEC.effect(vec![smoothing.cutoff_hz, kernel.unwrap_or_default() as f64])
    }
}

impl EffectSet {
    /// How the reference was smoothed; none without the effect.
    pub fn reference_smoothing(&self) -> Option<ZeroPhaseSmoothing> {
        let effect = self.get(EffectKind::ReferenceSmoothing)?;
        Some(ZeroPhaseSmoothing {
            cutoff_hz: effect.scalar(0),
            kernel: KERNELS[(effect.scalar(1) as usize).min(KERNELS.len() - 1)],
        })
    }
}
