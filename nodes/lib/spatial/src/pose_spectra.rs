//! Spectra of pose coordinates.

use std::f64::consts::PI;

use crate::segments::{HOP_S, centres};
use crate::{Spectrum, welch};

/// What a smoothed density is of its own entry, or of its neighbours' mean where that is within as
/// much of the entry, at most: the slope of a steep spectrum would spill into the noise. No source.
const LARGEST_SPILL: f64 = 4.0;

/// Height of a line in [`local_spectra`] over that in an unsmoothed spectrum: Hann's window gives its neighbours a quarter
/// each.
pub(crate) const LINE_SMOOTHED: f64 = 4.0 / 9.0;

/// Mean Welch spectrum of several coordinates, with windows of `window` samples.
pub(crate) fn mean_spectrum(coordinates: &[Vec<f64>], rate_hz: f64, window: usize) -> Spectrum {
    let mut mean = Spectrum::default();
    for series in coordinates {
        // Differences first: a steep spectrum would leak through the window. Undone by |2 sin(pi f
        // / rate)|^2.
        let differences: Vec<f64> = series.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let spectrum = welch(&differences, rate_hz, window);
        if mean.density.is_empty() {
            mean = Spectrum {
                density: vec![0.0; spectrum.density.len()],
                ..spectrum
            };
        }
        for (k, sum) in mean.density.iter_mut().enumerate() {
            let gain = 2.0 * (PI * k.max(1) as f64 * spectrum.spacing_hz / rate_hz).sin();
            *sum += spectrum.density[k] / (gain * gain * coordinates.len() as f64);
        }
    }
    mean
}

/// Spectra around the centres of the windows, smoothed over five neighbours (weights 1 2 3 2 1, over
/// 9).
pub(crate) fn local_spectra(coordinates: &[Vec<f64>], rate_hz: f64) -> Vec<Spectrum> {
    let count = coordinates[0].len();
    let length = ((2.0 * HOP_S * rate_hz) as usize).min(count);
    centres(count, rate_hz)
        .into_iter()
        .map(|centre| {
            let from = centre.saturating_sub(length / 2).min(count - length);
            let parts: Vec<Vec<f64>> = coordinates
                .iter()
                .map(|series| series[from..from + length].to_vec())
                .collect();
            let spectrum = mean_spectrum(&parts, rate_hz, length - 1);
            let density = (0..spectrum.density.len())
                .map(|k| smoothed(&spectrum.density, k))
                .collect();
            Spectrum {
                density,
                ..spectrum
            }
        })
        .collect()
}

/// An entry smoothed over its neighbours, but not where the spectrum is steep.
fn smoothed(density: &[f64], k: usize) -> f64 {
    let near = |step: usize| {
        0.5 * (density[k.saturating_sub(step)] + density[(k + step).min(density.len() - 1)])
    };
    let smooth = (density[k] * 3.0 + near(1) * 4.0 + near(2) * 2.0) / 9.0;
    smooth.min(LARGEST_SPILL * density[k].max(near(1).min(density[k] * LARGEST_SPILL)))
}
