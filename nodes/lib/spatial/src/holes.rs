//! Filling holes in stationary series.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rustfft::num_complex::Complex64;

use crate::{FourierPair, Spectrum};

/// Holes longer than this are left as they are: nothing is known in their middle.
const LONGEST: usize = 600;

/// Replaces the entries in `holes` by the likeliest ones, given the others and the series' spectrum
/// S.
///
/// For a stationary Gaussian series the negative log-likelihood is `1/2 x^T C^-1 x`, where C^-1 has
/// the spectrum 1/S; its minimum over the missing entries m, given the observed o, solves `C^-1_mm
/// x_m = -C^-1_mo x_o`. The straight line between the series' ends is left out.
pub(crate) fn fill_holes(
    series: &mut [Vec<f64>],
    holes: &[Range<usize>],
    spectrum: &Spectrum,
    transform: &FourierPair,
    rate_hz: f64,
) {
    let length = transform.length();
    let least = spectrum
        .density
        .iter()
        .copied()
        .filter(|density| *density > 0.0)
        .fold(f64::INFINITY, f64::min);
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
    for hole in holes.iter().filter(|hole| hole.len() <= LONGEST) {
        let matrix = DMatrix::from_fn(hole.len(), hole.len(), |i, j| {
            kernel(i.abs_diff(j)) + if i == j { 1e-12 } else { 0.0 }
        });
        let Some(factor) = matrix.cholesky() else {
            continue;
        };
        for values in series.iter_mut() {
            let last = values.len() - 1;
            let line = |k: usize| values[0] + (values[last] - values[0]) * k as f64 / last as f64;
            let right = DVector::from_fn(hole.len(), |i, _| {
                let entry = hole.start + i;
                -(0..values.len())
                    .filter(|k| !hole.contains(k))
                    .map(|k| kernel(k.abs_diff(entry)) * (values[k] - line(k)))
                    .sum::<f64>()
            });
            let missing = factor.solve(&right);
            let filled: Vec<f64> = (0..hole.len())
                .map(|i| missing[i] + line(hole.start + i))
                .collect();
            values[hole.clone()].copy_from_slice(&filled);
        }
    }
}
