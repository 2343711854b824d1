//! `vibration`: a sinusoid of both channels at the sensor, each axis with amplitude and phase of its
//! own; coherent over the session.

use std::f64::consts::TAU;

use super::clock_drift::Clock;
use super::residual_view::ResidualView;
use super::search::{FirstGuess, FittedSearch, Kept, Search, always};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::spectral_line::strongest_line;
use super::wave::SpectralLine;
use super::{Effect, EffectKind, EffectSet};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::Vibration,
    name: "vibration",
    stage: Stage::Timing,
    owner: Owner::Session,
    summary: "Something vibrates at the sensor (a motor, a fan): the residual of one channel or both has a sharp line of one frequency.",
    remedy: "Find and damp the source, or mount the sensor on rubber.",
    parameters: &[
        ParameterSpec {
            name: "hz",
            unit: "Hz",
            shape: Shape::Scalar,
            neutral: &[10.0],
            is_optional: false,
            lower: 0.01,
            upper: 1e5,
            fit: Some(ParameterFit {
                step: 1e-5,
                prior_deviation: 50.0,
            }),
        },
        amplitude("amplitude", "m/s2", 5.0),
        phase("phase"),
        amplitude("gyro_amplitude", "rad/s", 1.0),
        phase("gyro_phase"),
    ],
    channels: &Channel::ALL,
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::FromResidual(starts),
        companion: None,
        is_plausible: always,
        ordinary: None,
        rounding: None,
        kept: Kept::Never,
        special_case_of: &[],
        identifiability: None,
    }),
};

const fn amplitude(name: &'static str, unit: &'static str, prior_deviation: f64) -> ParameterSpec {
    ParameterSpec {
        name,
        unit,
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -1e3,
        upper: 1e3,
        fit: Some(ParameterFit {
            step: 1e-4,
            prior_deviation,
        }),
    }
}

/// At t0; a fit may go on a turn beyond the one that it starts in.
const fn phase(name: &'static str) -> ParameterSpec {
    ParameterSpec {
        name,
        unit: "rad",
        shape: Shape::Vector3,
        neutral: &[0.0; 3],
        is_optional: false,
        lower: -2.0 * TAU,
        upper: 2.0 * TAU,
        fit: Some(ParameterFit {
            step: 1e-4,
            prior_deviation: 10.0,
        }),
    }
}

impl Effect {
    /// The line of a vibration; none of any other effect.
    pub fn spectral_line(&self) -> Option<SpectralLine> {
        (self.kind() == EffectKind::Vibration).then(|| SpectralLine::from_effect(self))
    }

    /// What was found by the stamps, for a set whose clocks drift apart: a vibration by its clock. 1500 ppm of 16 Hz are three and a
    /// half turns in 146 s. Other effects stay as they are.
    #[must_use]
    pub fn by_clock_of(self, set: &EffectSet) -> Self {
        let line = self.spectral_line();
        let by_clock = line.map(|line| line.by_clock(Clock::of(&EffectSet::new()), Clock::of(set)));
        by_clock
            .and_then(|line| SPEC.effect(line.values()).ok())
            .unwrap_or(self)
    }
}

impl EffectSet {
    /// Of the kinds that are in both sets, takes the values of the other; a vibration beside a drift of
    /// the clocks that only the other set has goes by the stamps then, as it does in the readings.
    pub fn take_values_of(&mut self, other: &Self) {
        let shared: Vec<Effect> = self
            .iter()
            .filter_map(|effect| other.get(effect.kind()).cloned())
            .collect();
        self.extend(&shared);
        if let Some(vibration) = self.vibration_by_own_clock(other) {
            self.insert(vibration);
        }
    }

    /// The vibration of a set as it is by this set's clock, where a drift of the clocks is in that set
    /// alone: one that is no cause is the reference's, and a vibration of the device is steady by the
    /// device's clock. 20 ppm of 30 Hz are a tenth of a turn in three minutes.
    fn vibration_by_own_clock(&self, fitted: &Self) -> Option<Effect> {
        let drift = EffectKind::ClockDrift;
        if self.contains(drift) || !fitted.contains(drift) || !self.contains(EffectKind::Vibration)
        {
            return None;
        }
        let line = fitted.get(EffectKind::Vibration)?.spectral_line()?;
        let by_own = line.by_clock(Clock::of(fitted), Clock::of(self));
        SPEC.effect(by_own.values()).ok()
    }
}

/// The strongest line of the residual; the neutral values where there is none.
fn starts(view: &ResidualView) -> Vec<Vec<f64>> {
    vec![strongest_line(view).map_or_else(|| SPEC.neutral(), |line| line.values())]
}
