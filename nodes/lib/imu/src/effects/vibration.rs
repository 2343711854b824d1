//! `vibration`: a sinusoid of both channels at the sensor, each axis with amplitude and phase of its
//! own; coherent over the session.

use std::f64::consts::TAU;

use super::residual_view::ResidualView;
use super::search::{FirstGuess, FittedSearch, Search, always};
use super::spec::{EffectSpec, Owner, ParameterFit, ParameterSpec, Shape, Stage};
use super::spectral_line::strongest_line;
use super::wave::SpectralLine;
use super::{Effect, EffectKind};
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
        is_calibration: false,
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
}

/// The strongest line of the residual; the neutral values where there is none.
fn starts(view: &ResidualView) -> Vec<Vec<f64>> {
    vec![strongest_line(view).map_or_else(|| SPEC.neutral(), |line| line.values())]
}
