//! Filling gaps in stationary series.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
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

/// Replaces the entries in `gaps` by the likeliest ones, given the others and the series' spectrum
/// S.
///
/// For a stationary Gaussian series the negative log-likelihood is `1/2 x^T C^-1 x`, where C^-1 has
/// the spectrum 1/S; its minimum over the missing entries m, given the observed o, solves `C^-1_mm
/// x_m = -C^-1_mo x_o`. The straight line between the series' ends is left out.
pub(crate) fn fill_gaps(
    series: &mut [Vec<f64>],
    gaps: &[Range<usize>],
    spectrum: &Spectrum,
    transform: &FourierPair,
    rate_hz: f64,
) {
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
    // Never cut short: what is smooth and large has to cancel over its whole length.
    let kernel = |distance: usize| kernel[distance].re;
    for gap in gaps.iter().filter(|gap| gap.len() <= LONGEST_GAP) {
        let matrix = DMatrix::from_fn(gap.len(), gap.len(), |i, j| {
            kernel(i.abs_diff(j)) + if i == j { RIDGE } else { 0.0 }
        });
        let Some(factor) = matrix.cholesky() else {
            continue;
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
    }
}
