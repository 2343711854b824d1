//! Where a residual lies: by channel, axis, frequency and time.

use std::ops::Range;

use cromosim_imu::{AXES, Channel};
use cromosim_spatial::{Spectrum, welch};

use crate::axes::axes_of_channel;
use crate::diagnosis::{GapLocation, Interval};
use crate::prepared::PreparedPlacement;
use crate::whiten::Whitener;

/// Edges of the frequency bands, Hz; the last ends at Nyquist.
const BANDS_HZ: [f64; 8] = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
/// Parts of equal length that a recording is cut into.
const INTERVALS: usize = 12;

/// Shares of a whitened residual (flat, as [`Whitener::apply`] gives it) beyond unit variance.
pub(crate) fn locate(
    white: &[f64],
    prepared: &PreparedPlacement,
    whitener: &Whitener,
) -> GapLocation {
    let length = prepared.length;
    let axes: Vec<f64> = (0..6)
        .map(|axis| excess(white, whitener, axis, 0..length).max(0.0))
        .collect();
    let axis_shares = shares(&axes);
    let channel_share =
        |channel: Channel| axis_shares[axes_of_channel(channel)].iter().sum::<f64>();
    let intervals: Vec<(f64, f64, f64)> = (0..INTERVALS)
        .map(|k| (k * length / INTERVALS, (k + 1) * length / INTERVALS))
        .map(|(from, to)| {
            let sum: f64 = (0..6)
                .map(|axis| excess(white, whitener, axis, from..to))
                .sum();
            let seconds = |entry: usize| entry as f64 / prepared.rate_hz;
            (seconds(from), seconds(to), sum.max(0.0))
        })
        .collect();
    GapLocation {
        channels: Channel::ALL
            .into_iter()
            .map(|channel| (channel.prefix().to_owned(), channel_share(channel)))
            .collect(),
        axes: AXES
            .iter()
            .zip(&axis_shares)
            .map(|(name, share)| ((*name).to_owned(), *share))
            .collect(),
        bands_hz: as_intervals(&band_excesses(white, prepared)),
        intervals_s: as_intervals(&intervals),
    }
}

/// Sum of the squares of an axis' whitened residual beyond unit variance, over entries of the sample
/// grid.
fn excess(white: &[f64], whitener: &Whitener, axis: usize, entries: Range<usize>) -> f64 {
    let weight = &whitener.weight[axis];
    let first = axis * weight.len();
    let weights: f64 = weight[entries.clone()]
        .iter()
        .map(|weight| weight * weight)
        .sum();
    let own = &white[first + entries.start..first + entries.end];
    own.iter().map(|e| e * e).sum::<f64>() - weights
}

/// Each band, Hz, and the density of the whitened residual beyond that of white noise in it, summed
/// over axes.
fn band_excesses(white: &[f64], prepared: &PreparedPlacement) -> Vec<(f64, f64, f64)> {
    let total = summed_spectrum(white, prepared, 0..6);
    let nyquist_hz = prepared.rate_hz / 2.0;
    bands(nyquist_hz)
        .into_iter()
        .map(|(from, to)| {
            let excess: f64 = total
                .band(from, to)
                .iter()
                .map(|density| density - 6.0 / nyquist_hz)
                .sum();
            (from, to, excess.max(0.0))
        })
        .collect()
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

/// How loud a channel's whitened residual is by frequency.
pub(crate) struct Loudness {
    spectrum: Spectrum,
    /// Of a mean density, to a mean square of what is compared.
    scale: f64,
}

impl Loudness {
    pub fn new(
        white: &[f64],
        prepared: &PreparedPlacement,
        whitener: &Whitener,
        channel: Channel,
    ) -> Self {
        let kept = whitener.count[channel] / (3.0 * prepared.length as f64);
        Self {
            spectrum: summed_spectrum(white, prepared, axes_of_channel(channel)),
            scale: prepared.rate_hz / 6.0 / kept.max(1e-9),
        }
    }

    /// Mean square between two frequencies, Hz; 1 for the predicted noise.
    pub fn between(&self, from_hz: f64, to_hz: f64) -> f64 {
        let band = self.spectrum.band(from_hz, to_hz);
        band.iter().sum::<f64>() / band.len().max(1) as f64 * self.scale
    }
}

/// Sum over axes of the spectra of a flat whitened residual: 2 / rate each where it is white.
pub(crate) fn summed_spectrum(
    white: &[f64],
    prepared: &PreparedPlacement,
    axes: Range<usize>,
) -> Spectrum {
    let window = ((4.0 * prepared.rate_hz) as usize)
        .min(prepared.length / 2)
        .max(8);
    let mut total = Spectrum::default();
    for axis in axes {
        let spectrum = welch(
            &white[axis * prepared.length..(axis + 1) * prepared.length],
            prepared.rate_hz,
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
