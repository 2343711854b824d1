//! Where a residual lies: by channel, axis, frequency and time.

use std::collections::BTreeMap;

use cromosim_spatial::{Spectrum, welch};

use crate::problem::Problem;
use crate::whiten::Whitener;
use crate::{AXES, Interval, Place};

/// Edges of the frequency bands, Hz; the last ends at Nyquist.
pub(crate) const BANDS_HZ: [f64; 8] = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
/// Intervals of time.
const INTERVALS: usize = 12;

/// Shares of a whitened residual (flat, as [`Whitener::apply`] gives it) beyond unit variance.
pub(crate) fn place(white: &[f64], problem: &Problem, whitener: &Whitener) -> Place {
    let length = problem.length;
    let squares = |axis: usize, from: usize, to: usize| -> f64 {
        let range = axis * length + from..axis * length + to;
        let weights: f64 = whitener.weight[axis][from..to]
            .iter()
            .map(|weight| weight * weight)
            .sum();
        white[range].iter().map(|e| e * e).sum::<f64>() - weights
    };
    let axes: Vec<f64> = (0..6)
        .map(|axis| squares(axis, 0, length).max(0.0))
        .collect();
    let axis_shares = shares(&axes);
    let channels = [
        axis_shares[..3].iter().sum::<f64>(),
        axis_shares[3..].iter().sum::<f64>(),
    ];
    let intervals: Vec<(f64, f64, f64)> = (0..INTERVALS)
        .map(|k| (k * length / INTERVALS, (k + 1) * length / INTERVALS))
        .map(|(from, to)| {
            let sum = (0..6)
                .map(|axis| squares(axis, from, to))
                .sum::<f64>()
                .max(0.0);
            (
                from as f64 / problem.rate_hz,
                to as f64 / problem.rate_hz,
                sum,
            )
        })
        .collect();
    let total = spectrum_of(white, problem, 0..6);
    let nyquist_hz = problem.rate_hz / 2.0;
    let bands: Vec<(f64, f64, f64)> = bands(nyquist_hz)
        .into_iter()
        .map(|(from, to)| {
            let excess: f64 = total
                .band(from, to)
                .iter()
                .map(|density| density - 6.0 / nyquist_hz)
                .sum();
            (from, to, excess.max(0.0))
        })
        .collect();
    Place {
        channels: BTreeMap::from([
            ("accel".to_owned(), channels[0]),
            ("gyro".to_owned(), channels[1]),
        ]),
        axes: AXES
            .iter()
            .zip(&axis_shares)
            .map(|(name, share)| ((*name).to_owned(), *share))
            .collect(),
        bands_hz: as_intervals(&bands),
        intervals_s: as_intervals(&intervals),
    }
}

/// The bands below Nyquist.
pub(crate) fn bands(nyquist_hz: f64) -> Vec<(f64, f64)> {
    let edges: Vec<f64> = BANDS_HZ
        .into_iter()
        .filter(|edge| *edge < nyquist_hz)
        .chain(std::iter::once(nyquist_hz))
        .collect();
    edges.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

/// Sum over axes of the spectra of a flat whitened residual: 2 / rate each where it is white.
pub(crate) fn spectrum_of(
    white: &[f64],
    problem: &Problem,
    axes: std::ops::Range<usize>,
) -> Spectrum {
    let window = ((4.0 * problem.rate_hz) as usize)
        .min(problem.length / 2)
        .max(8);
    let mut total = Spectrum::default();
    for axis in axes {
        let spectrum = welch(
            &white[axis * problem.length..(axis + 1) * problem.length],
            problem.rate_hz,
            window,
        );
        if total.density.is_empty() {
            total = Spectrum {
                density: vec![0.0; spectrum.density.len()],
                ..spectrum
            };
        }
        total
            .density
            .iter_mut()
            .zip(&spectrum.density)
            .for_each(|(sum, value)| *sum += value);
    }
    total
}

fn as_intervals(parts: &[(f64, f64, f64)]) -> Vec<Interval> {
    let shares = shares(&parts.iter().map(|part| part.2).collect::<Vec<_>>());
    parts
        .iter()
        .zip(shares)
        .map(|(&(from, to, _), share)| Interval { from, to, share })
        .collect()
}

fn shares(values: &[f64]) -> Vec<f64> {
    let total: f64 = values.iter().sum();
    values
        .iter()
        .map(|value| {
            if total > 0.0 {
                value / total
            } else {
                1.0 / values.len() as f64
            }
        })
        .collect()
}
