//! Filling gaps in stationary series, and how far what is filled in may be off.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rustfft::num_complex::Complex64;

use crate::{FourierPair, Spectrum};

/// Longest gap that is filled, entries: in the middle of longer ones nothing is known, and the cost
/// grows with the third power. No source for the number.
const LONGEST_GAP: usize = 600;
/// Added to the diagonal of a matrix whose other entries are at most 1, so that rounding does not
/// make it singular; no source.
const RIDGE: f64 = 1e-12;

/// Densities below this part of the largest count as it: those of smoothed poses fall by sixteen decades,
/// more than the ridge leaves room for, which would then pull at the motion and bend the series where
/// the gap begins. No source.
const LEAST_DENSITY: f64 = 1e-11;

/// Distance of the entries whose differences stand for derivatives of what is filled in, s: short against
/// what a pose's motion changes in, long enough for the poses' noise not to stand out.
const DIFFERENCE_S: f64 = 0.02;

/// What series that are filled have in common.
pub(crate) struct Filling<'a> {
    /// Their mean spectrum, noise included.
    pub spectrum: &'a Spectrum,
    /// One-sided density of their white noise.
    pub noise: f64,
    pub transform: &'a FourierPair,
    pub rate_hz: f64,
}

/// Variances of the errors of a value and of its first and second derivative, mean over the series, at some
/// distances from the nearest entry that was there, s; increasing.
pub(crate) type FillErrors = Vec<(f64, [f64; 3])>;

/// Replaces the entries in `gaps` by the likeliest ones, given the others and the series' spectrum
/// S; says how far each gap's may be off.
///
/// For a stationary Gaussian series the negative log-likelihood is `1/2 x^T C^-1 x`, where C^-1 has
/// the spectrum 1/S; its minimum over the missing entries m, given the observed o, solves `C^-1_mm
/// x_m = -C^-1_mo x_o`, and its errors have the covariance `(C^-1_mm)^-1`. The straight line between the series'
/// ends is left out.
pub(crate) fn fill_gaps(
    series: &mut [Vec<f64>],
    gaps: &[Range<usize>],
    filling: &Filling<'_>,
) -> Vec<FillErrors> {
    let (kernel, least) = inverse_covariance(filling);
    // Never cut short: what is smooth and large has to cancel over its whole length.
    let kernel = |distance: usize| kernel[distance].re;
    let count = series[0].len();
    let fill = |gap: &Range<usize>| {
        if gap.len() > LONGEST_GAP {
            return vec![(0.0, nothing_known(filling))];
        }
        let matrix = DMatrix::from_fn(gap.len(), gap.len(), |i, j| {
            kernel(i.abs_diff(j)) + if i == j { RIDGE } else { 0.0 }
        });
        let Some(factor) = matrix.cholesky() else {
            return vec![(0.0, nothing_known(filling))];
        };
        for values in series.iter_mut() {
            let last = values.len() - 1;
            let line = |k: usize| values[0] + (values[last] - values[0]) * k as f64 / last as f64;
            let right = DVector::from_fn(gap.len(), |i, _| {
                let entry = gap.start + i;
                -(0..values.len())
                    .filter(|k| !gap.contains(k))
                    .map(|k| kernel(k.abs_diff(entry)) * (values[k] - line(k)))
                    .sum::<f64>()
            });
            let missing = factor.solve(&right);
            let filled: Vec<f64> = (0..gap.len())
                .map(|i| missing[i] + line(gap.start + i))
                .collect();
            values[gap.clone()].copy_from_slice(&filled);
        }
        // C^-1 is the matrix over `least rate / 2`.
        errors(&factor, least * filling.rate_hz / 2.0, gap, count, filling)
    };
    gaps.iter().map(fill).collect()
}

/// The first column of C^-1, times the least density that counts, which comes with it.
fn inverse_covariance(filling: &Filling<'_>) -> (Vec<Complex64>, f64) {
    let Filling {
        spectrum,
        transform,
        rate_hz,
        ..
    } = *filling;
    let length = transform.length();
    let positive = || {
        spectrum
            .density
            .iter()
            .copied()
            .filter(|value| *value > 0.0)
    };
    let least = positive()
        .fold(f64::INFINITY, f64::min)
        .max(LEAST_DENSITY * positive().fold(0.0, f64::max));
    let mut kernel: Vec<Complex64> = (0..length)
        .map(|k| {
            let frequency_hz = k.min(length - k) as f64 * rate_hz / length as f64;
            Complex64::new(
                least
                    / spectrum
                        .at(frequency_hz.max(spectrum.spacing_hz))
                        .max(least),
                0.0,
            )
        })
        .collect();
    transform.inverse(&mut kernel);
    (kernel, least)
}

/// The variances that the conditional covariance `scale factor^-1` of a gap's entries leaves, less their own
/// noise: towards the middle of a gap, or from the entries on one side away.
fn errors(
    factor: &Cholesky<f64, Dyn>,
    scale: f64,
    gap: &Range<usize>,
    count: usize,
    filling: &Filling<'_>,
) -> FillErrors {
    let (length, rate_hz) = (gap.len(), filling.rate_hz);
    let apart = ((DIFFERENCE_S * rate_hz).round() as usize).max(1);
    let seconds = apart as f64 / rate_hz;
    let (is_first, is_last) = (gap.start == 0, gap.end == count);
    let deepest = if is_first || is_last {
        length - 1
    } else {
        (length - 1) / 2
    };
    let doubling = (0..)
        .map(|n| apart << n)
        .take_while(|depth| *depth < deepest);
    let depths = std::iter::once(0)
        .chain(doubling)
        .chain((deepest > 0).then_some(deepest));
    let noise = filling.noise * rate_hz / 2.0;
    let variance = |depth: usize, weights: [f64; 3]| {
        let middle = if is_first { length - 1 - depth } else { depth };
        let mut difference = DVector::zeros(length);
        let places = [
            middle.checked_sub(apart),
            Some(middle),
            Some(middle + apart),
        ];
        for (place, weight) in places.into_iter().zip(weights) {
            if let Some(value) = place.and_then(|place| difference.get_mut(place)) {
                *value = weight;
            }
        }
        let own = noise * difference.norm_squared();
        (scale * difference.dot(&factor.solve(&difference)) - own).max(0.0)
    };
    let first = 0.5 / seconds;
    let second = seconds.powi(-2);
    depths
        .map(|depth| {
            let of_derivatives = [
                variance(depth, [0.0, 1.0, 0.0]),
                variance(depth, [-first, 0.0, first]),
                variance(depth, [second, -2.0 * second, second]),
            ];
            ((depth + 1) as f64 / rate_hz, of_derivatives)
        })
        .collect()
}

/// The variances of the series themselves and of their derivatives, less their noise.
fn nothing_known(filling: &Filling<'_>) -> [f64; 3] {
    let spectrum = filling.spectrum;
    let mut sums = [0.0; 3];
    for (k, density) in spectrum.density.iter().enumerate().skip(1) {
        let squared = (TAU * k as f64 * spectrum.spacing_hz).powi(2);
        let mut power = (density - filling.noise).max(0.0) * spectrum.spacing_hz;
        for sum in &mut sums {
            *sum += power;
            power *= squared;
        }
    }
    sums
}
