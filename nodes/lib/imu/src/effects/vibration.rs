//! `vibration`: a sinusoid of both channels at the sensor, each axis with amplitude and phase of its
//! own; coherent over the session.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::residual_view::ResidualView;
use super::search::{FirstGuess, FittedSearch, Search, always};
use super::spec::{EffectSpec, ParameterFit, ParameterSpec, Shape, Stage};
use super::spectral_line::strongest_line;
use super::{Effect, EffectKind};
use crate::{Channel, PerChannel, Reading};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::Vibration,
    name: "vibration",
    stage: Stage::Timing,
    summary: "Something vibrates at the sensor (a motor, a fan): the residual of one channel or both has a sharp line of one frequency.",
    remedy: "Find and damp the source, or mount the sensor on rubber.",
    parameters: &[
        ParameterSpec {
            name: "hz",
            unit: "Hz",
            shape: Shape::Scalar,
            neutral: &[10.0],
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
        lower: -2.0 * TAU,
        upper: 2.0 * TAU,
        fit: Some(ParameterFit {
            step: 1e-4,
            prior_deviation: 10.0,
        }),
    }
}

/// `amplitude sin(2 pi hz (t - t0) + phase)` of each axis and channel, parsed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralLine {
    /// Frequency, Hz.
    pub hz: f64,
    /// Of the channels, in sensor axes.
    pub waves: PerChannel<Wave>,
}

/// One frequency on three axes: `sine sin(2 pi hz (t - t0)) + cosine cos(2 pi hz (t - t0))`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wave {
    /// In the channel's unit.
    pub sine: Vector3<f64>,
    /// In the channel's unit.
    pub cosine: Vector3<f64>,
}

impl Wave {
    /// `amplitude sin(x + phase) = amplitude cos(phase) sin(x) + amplitude sin(phase) cos(x)`.
    fn from_polar(amplitude: &Vector3<f64>, phase: &Vector3<f64>) -> Self {
        Self {
            sine: amplitude.zip_map(phase, |amplitude, phase| amplitude * phase.cos()),
            cosine: amplitude.zip_map(phase, |amplitude, phase| amplitude * phase.sin()),
        }
    }

    /// Amplitudes, and phases from 0 to 2 pi.
    fn polar(&self) -> [Vector3<f64>; 2] {
        [
            self.sine.zip_map(&self.cosine, f64::hypot),
            self.sine.zip_map(&self.cosine, |sine, cosine| {
                cosine.atan2(sine).rem_euclid(TAU)
            }),
        ]
    }

    /// Mean square, summed over the axes.
    fn power(&self) -> f64 {
        0.5 * (self.sine.norm_squared() + self.cosine.norm_squared())
    }

    fn filtered(&self, gain: f64, phase: f64) -> Self {
        let (sin, cos) = phase.sin_cos();
        Self {
            sine: (self.sine * cos - self.cosine * sin) * gain,
            cosine: (self.cosine * cos + self.sine * sin) * gain,
        }
    }
}

impl SpectralLine {
    /// Of a vibration's values.
    fn from_effect(effect: &Effect) -> Self {
        let wave = |first| Wave::from_polar(&effect.vector(first), &effect.vector(first + 3));
        Self {
            hz: effect.scalar(0),
            waves: PerChannel {
                accelerometer: wave(1),
                gyroscope: wave(7),
            },
        }
    }

    /// A vibration's values.
    fn values(&self) -> Vec<f64> {
        let polar = Channel::ALL.map(|channel| self.waves[channel].polar());
        let values = polar.iter().flatten().flat_map(|vector| vector.iter());
        std::iter::once(self.hz).chain(values.copied()).collect()
    }

    /// What it adds to both channels at seconds since the epoch.
    #[inline]
    pub(super) fn at(&self, seconds: f64) -> Reading {
        let (sin, cos) = (TAU * self.hz * seconds).sin_cos();
        let [specific_force, angular_velocity] = Channel::ALL.map(|channel| {
            let wave = &self.waves[channel];
            wave.sine * sin + wave.cosine * cos
        });
        Reading {
            specific_force,
            angular_velocity,
        }
    }

    /// Mean square of a channel, summed over the axes, m2/s4 or rad2/s2.
    pub fn power(&self, channel: Channel) -> f64 {
        self.waves[channel].power()
    }

    /// What a filter of this gain and phase leaves of it.
    pub(super) fn filtered(self, (gain, phase): (f64, f64)) -> Self {
        Self {
            waves: PerChannel::from_fn(|channel| self.waves[channel].filtered(gain, phase)),
            ..self
        }
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
