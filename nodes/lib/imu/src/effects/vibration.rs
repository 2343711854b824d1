//! `vibration`: a sinusoid of specific force at the sensor, coherent over the session.

use std::f64::consts::{PI, TAU};

use cromosim_spatial::{Complex64, FourierPair};
use nalgebra::{Matrix3x2, Vector3};

use super::residual_view::{ResidualView, median};
use super::search::{FirstGuess, FittedSearch, Search, always};
use super::spec::{EffectSpec, ParameterFit, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::Vibration,
    name: "vibration",
    stage: Stage::Timing,
    summary: "Something vibrates at the sensor (a motor, a fan): the specific force's residual has a sharp line of one frequency.",
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
        ParameterSpec {
            name: "amplitude",
            unit: "m/s2",
            shape: Shape::Vector3,
            neutral: &[0.0; 3],
            lower: -1e3,
            upper: 1e3,
            fit: Some(ParameterFit {
                step: 1e-4,
                prior_deviation: 5.0,
            }),
        },
        ParameterSpec {
            name: "phase",
            unit: "rad",
            shape: Shape::Scalar,
            neutral: &[0.0],
            lower: -TAU,
            upper: TAU,
            fit: Some(ParameterFit {
                step: 1e-4,
                prior_deviation: 10.0,
            }),
        },
    ],
    channels: &[Channel::Accelerometer],
    search: Search::Fitted(FittedSearch {
        first_guess: FirstGuess::FromResidual(starts),
        is_plausible: always,
        ordinary: None,
        rounding: None,
        is_calibration: false,
        special_case_of: &[],
        identifiability: None,
    }),
};

/// `amplitude sin(2 pi hz (t - t0) + phase)`, parsed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralLine {
    /// Frequency, Hz.
    pub hz: f64,
    /// Of each sensor axis, m/s2.
    pub amplitude: Vector3<f64>,
    /// At t0, rad.
    pub phase: f64,
}

impl SpectralLine {
    /// Of a vibration's values.
    pub(super) fn from_effect(effect: &Effect) -> Self {
        Self {
            hz: effect.scalar(0),
            amplitude: effect.vector(1),
            phase: effect.scalar(4),
        }
    }

    /// Specific force at seconds since the epoch, in sensor axes.
    #[inline]
    pub(super) fn at(&self, seconds: f64) -> Vector3<f64> {
        self.amplitude * (TAU * self.hz * seconds + self.phase).sin()
    }

    /// Mean square of the specific force, summed over the axes, m2/s4.
    pub fn power(&self) -> f64 {
        self.amplitude
            .iter()
            .map(|amplitude| 0.5 * amplitude * amplitude)
            .sum()
    }

    /// What a filter of this gain and phase leaves of it.
    pub(super) fn filtered(self, (gain, phase): (f64, f64)) -> Self {
        Self {
            amplitude: self.amplitude * gain,
            phase: self.phase + phase,
            ..self
        }
    }
}

/// Readings below which no line is looked for.
const LEAST_READINGS: usize = 64;
/// Least frequency that is looked at, Hz: below it the residual of motion lives.
const LEAST_HZ: f64 = 2.0;

impl Effect {
    /// The line of a vibration; none of any other effect.
    pub fn spectral_line(&self) -> Option<SpectralLine> {
        (self.kind() == EffectKind::Vibration).then(|| SpectralLine::from_effect(self))
    }
}

/// The strongest line of the residual; the neutral values where there is none.
fn starts(view: &ResidualView) -> Vec<Vec<f64>> {
    let values = strongest_line(view).map(|line| {
        let [x, y, z] = line.amplitude.into();
        vec![line.hz, x, y, z, line.phase]
    });
    vec![values.unwrap_or_else(|| SPEC.neutral())]
}

/// The line of the accelerometer's residual that stands out most over its surroundings, with
/// amplitudes and phase by least squares in absolute time.
pub fn strongest_line(view: &ResidualView) -> Option<SpectralLine> {
    let residual: Vec<Vector3<f64>> = view.residual(Channel::Accelerometer).collect();
    if residual.len() < LEAST_READINGS || view.rate_hz.is_nan() || view.rate_hz <= 0.0 {
        return None;
    }
    let seconds: Vec<f64> = view
        .stamps
        .iter()
        .map(|stamp| *stamp - view.epoch)
        .collect();
    let mean = residual.iter().sum::<Vector3<f64>>() / residual.len() as f64;
    let (coarse, width) = coarse_line(&seconds, &residual, &mean, view.rate_hz)?;
    let power = |hz: f64| fit(&seconds, &residual, &mean, hz).norm_squared();
    let hz = refined(power, coarse, width);
    let svd = fit(&seconds, &residual, &mean, hz).svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let (strongest, sigma) = svd.singular_values.argmax();
    // S = A cos(phase), C = A sin(phase), as A sin(x + phase) = S sin x + C cos x.
    let phase = v_t[(strongest, 1)].atan2(v_t[(strongest, 0)]);
    Some(SpectralLine {
        hz,
        amplitude: u.column(strongest) * sigma,
        phase: phase.clamp(-PI, PI),
    })
}

/// Coefficients of sine and cosine for each axis, by least squares.
fn fit(seconds: &[f64], residual: &[Vector3<f64>], mean: &Vector3<f64>, hz: f64) -> Matrix3x2<f64> {
    let (mut ss, mut sc, mut cc) = (0.0, 0.0, 0.0);
    let (mut with_sine, mut with_cosine) = (Vector3::zeros(), Vector3::zeros());
    for (seconds, residual) in seconds.iter().zip(residual) {
        let (sine, cosine) = (TAU * hz * seconds).sin_cos();
        let residual = residual - mean;
        (ss, sc, cc) = (ss + sine * sine, sc + sine * cosine, cc + cosine * cosine);
        with_sine += residual * sine;
        with_cosine += residual * cosine;
    }
    let determinant = ss * cc - sc * sc;
    Matrix3x2::from_columns(&[
        (with_sine * cc - with_cosine * sc) / determinant,
        (with_cosine * ss - with_sine * sc) / determinant,
    ])
}

/// The greatest value near a coarse peak, by golden sections.
fn refined(power: impl Fn(f64) -> f64, peak: f64, width: f64) -> f64 {
    let golden = 0.618_033_988_749_895;
    let (mut low, mut high) = (peak - width, peak + width);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_a, mut at_b) = (power(a), power(b));
    for _ in 0..40 {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - golden * (high - low);
            at_a = power(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + golden * (high - low);
            at_b = power(b);
        }
        if high - low < 1e-7 {
            break;
        }
    }
    0.5 * (low + high)
}

/// Frequency of the bin that stands out most over the median of its surroundings, and the bins'
/// spacing, from a zero-padded spectrum of all axes.
fn coarse_line(
    seconds: &[f64],
    residual: &[Vector3<f64>],
    mean: &Vector3<f64>,
    rate_hz: f64,
) -> Option<(f64, f64)> {
    let first = *seconds.first()?;
    let count = ((seconds.last()? - first) * rate_hz).round() as usize + 1;
    let size = (2 * count).next_power_of_two();
    if size > 1 << 24 {
        return None;
    }
    let transform = FourierPair::new(size);
    let mut power = vec![0.0; size / 2];
    for axis in 0..3 {
        let mut signal = vec![Complex64::default(); size];
        for (seconds, residual) in seconds.iter().zip(residual) {
            let index = ((seconds - first) * rate_hz).round() as usize;
            // A Hann window, so that strong motion does not leak over the line.
            let window = 0.5 - 0.5 * (TAU * index as f64 / count as f64).cos();
            signal[index.min(size - 1)].re = (residual[axis] - mean[axis]) * window;
        }
        transform.forward(&mut signal);
        power
            .iter_mut()
            .zip(&signal)
            .for_each(|(power, value)| *power += value.norm_sqr());
    }
    let spacing = rate_hz / size as f64;
    let around = ((1.0 / spacing) as usize).max(20);
    let lowest = (LEAST_HZ / spacing).ceil() as usize;
    let mut best = (0.0, 0);
    for k in lowest.max(1)..power.len() - 1 {
        if power[k] < power[k - 1] || power[k] < power[k + 1] {
            continue;
        }
        let mut neighbours =
            power[k.saturating_sub(around).max(lowest)..(k + around).min(power.len())].to_vec();
        let score = power[k] / median(&mut neighbours).max(f64::MIN_POSITIVE);
        if score > best.0 {
            best = (score, k);
        }
    }
    (best.1 > 0).then_some((best.1 as f64 * spacing, spacing))
}
