//! `low_pass`: the device's own second-order Butterworth filter, on both channels.

use super::residual_view::ResidualView;
use super::search::{Dependence, FirstGuess, FittedSearch, Kept, Search};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind, EffectSet};
use crate::{Channel, EffectError};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::LowPass,
    name: "low_pass",
    stage: Stage::Sensor,
    owner: Owner::Device,
    summary: "The device smooths both channels: fast motion is weaker and everything comes late by 0.225 / cutoff_hz.",
    remedy: "Raise the device's bandwidth setting, or put the same filter into the simulation.",
    parameters: &[ParameterSpec {
        fit: Some(ParameterFit {
            step: 1e-3,
            prior_deviation: 50.0,
        }),
        ..CUTOFF
    }],
    channels: &Channel::ALL,
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::FromResidual(starts),
        companion: None,
        is_plausible,
        ordinary: None,
        rounding: None,
        kept: Kept::Never,
        special_case_of: &[Dependence::DelayOverTime],
        identifiability: None,
    }),
};

/// The cutoff of a filter, as it is before any fit.
pub(super) const CUTOFF: ParameterSpec = ParameterSpec {
    name: "cutoff_hz",
    unit: "Hz",
    shape: Shape::Scalar,
    neutral: &[1e4],
    is_optional: false,
    lower: 0.1,
    upper: 1e4,
    fit: None,
};

/// Damping ratio of the Butterworth filter: Q = 1/sqrt(2).
pub(super) const DAMPING_RATIO: f64 = std::f64::consts::FRAC_1_SQRT_2;

fn starts(_: &ResidualView) -> Vec<Vec<f64>> {
    [4.0, 8.0, 14.0, 25.0, 40.0]
        .map(|cutoff_hz| vec![cutoff_hz])
        .to_vec()
}

/// Gain and phase (rad, negative is late) at a frequency.
pub(super) fn response(cutoff_hz: f64, hz: f64) -> (f64, f64) {
    let ratio = hz / cutoff_hz;
    // 1 / (1 - r^2 + 2 i z r)
    let (real, imaginary) = (1.0 - ratio * ratio, 2.0 * DAMPING_RATIO * ratio);
    (real.hypot(imaginary).recip(), -imaginary.atan2(real))
}

/// Highest cutoff that counts, Hz: a filter above it passes all motion. Without a measurement on
/// record.
const HIGHEST_HZ: f64 = 45.0;
/// Delay of slow motion times the cutoff: `sqrt(2) / (2 pi)`, the filter's group delay at 0 Hz.
const DELAY_TIMES_CUTOFF: f64 = 0.225;
/// Deviation from the filter's delay, as a part of it, up to which an offset of time undoes it.
const UNDONE: f64 = 0.35;

impl Effect {
    /// The `low_pass` that delays slow motion by so many seconds.
    ///
    /// # Errors
    /// [`EffectError`] for a delay that none has.
    pub fn low_pass_with_delay(seconds: f64) -> Result<Self, EffectError> {
        SPEC.effect(vec![DELAY_TIMES_CUTOFF / seconds])
    }

    /// By how much a `low_pass` delays slow motion, s; none of another effect.
    pub fn low_pass_delay(&self) -> Option<f64> {
        (self.kind() == EffectKind::LowPass).then(|| DELAY_TIMES_CUTOFF / self.scalar(0))
    }
}

/// Not where an offset of time beside it takes back its delay: a filter's attenuation without its
/// delay is the reference's own smoothing error.
fn is_plausible(effect: &Effect, set: &EffectSet) -> bool {
    let cutoff_hz = effect.scalar(0);
    let delay = DELAY_TIMES_CUTOFF / cutoff_hz;
    let is_undone = set.get(EffectKind::TimeOffset).is_some_and(|offset| {
        (offset.scalar(0) + delay).abs() < UNDONE * DELAY_TIMES_CUTOFF / cutoff_hz
    });
    cutoff_hz <= HIGHEST_HZ && !is_undone
}
