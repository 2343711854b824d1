//! `clock_drift`: the IMU's clock runs at another rate; with `time_offset` it makes stamps of true
//! times.

use super::search::{
    Dependence, FirstGuess, FittedSearch, Identifiability, Kept, Ordinary, Search, always,
};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::{EffectKind, EffectSet};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ClockDrift,
    name: "clock_drift",
    stage: Stage::Timing,
    owner: Owner::Session,
    summary: "The IMU's clock runs fast (positive) or slow: the residual is proportional to the time derivative and grows with time.",
    remedy: "Discipline the clock (PTP, a common oscillator), or stretch the stamps by this rate.",
    parameters: &[ParameterSpec {
        name: "ppm",
        unit: "1e-6",
        shape: Shape::Scalar,
        neutral: &[0.0],
        is_optional: false,
        lower: -1e5,
        upper: 1e5,
        fit: Some(ParameterFit {
            step: 0.1,
            prior_deviation: 3000.0,
        }),
    }],
    channels: &Channel::ALL,
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::Neutral,
        companion: None,
        is_plausible: always,
        ordinary: Some(Ordinary::EachValue(ORDINARY_PPM)),
        rounding: None,
        kept: Kept::Never,
        special_case_of: &[Dependence::DelayOverTime],
        identifiability: Some(Identifiability {
            relevant_size: 200.0,
            values: 1,
            would_tell: "a recording of a minute or more with motion throughout",
        }),
    }),
};

/// Up to this two clocks ordinarily drift apart.
const ORDINARY_PPM: f64 = 30.0;

impl EffectKind {
    /// Standard deviation of each fitted value that no recording takes away, however long it is: what is
    /// fitted is the rate of the device's clock against the reference's, which is no better than others.
    pub fn error_of_reference(self) -> f64 {
        match self {
            // Evenly spread up to what is ordinary.
            Self::ClockDrift => ORDINARY_PPM / 3.0_f64.sqrt(),
            _ => 0.0,
        }
    }
}

/// Stamps and true times: `stamp = t0 + (t - t0) (1 + ppm 1e-6) + seconds`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    pub offset: f64,
    pub ppm: f64,
}

impl Clock {
    /// With the offset and the drift of a set.
    pub(super) fn of(effects: &EffectSet) -> Self {
        let value = |kind| effects.get(kind).map_or(0.0, |effect| effect.scalar(0));
        Self {
            offset: value(EffectKind::TimeOffset),
            ppm: value(EffectKind::ClockDrift),
        }
    }

    /// True seconds since the epoch, of a stamp's seconds since the epoch.
    #[inline]
    pub(super) fn true_seconds(&self, stamp: f64) -> f64 {
        (stamp - self.offset) / (1.0 + self.ppm * 1e-6)
    }

    /// The inverse.
    pub(super) fn stamp_seconds(&self, seconds: f64) -> f64 {
        seconds * (1.0 + self.ppm * 1e-6) + self.offset
    }
}
