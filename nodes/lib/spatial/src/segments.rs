//! Filters that change over time, and derivatives through them.

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex64;

use crate::FourierPair;
use crate::spectrum::interpolated;

/// Distance of the windows' centres, s; each is cross-faded with its neighbours over this time. No source.
pub(crate) const HOP_S: f64 = 2.0;
/// What is taken beyond the cross-fade on either side, s: room for the filter's response. No source.
const MARGIN_S: f64 = 1.0;
/// What is taken beyond that, s, and faded out by a raised cosine. No source.
const TAPER_S: f64 = 1.5;

/// A zero-phase filter by its weights at evenly spaced frequencies.
#[derive(Clone, Debug)]
pub(crate) struct Filter {
    /// Distance of two frequencies, Hz.
    pub spacing_hz: f64,
    /// Gains from 0 Hz on.
    pub weights: Vec<f64>,
    /// Density of the window's noise, in units of that of the whole series.
    pub noise: f64,
}

impl Filter {
    /// Gain at a frequency.
    pub fn at(&self, frequency_hz: f64) -> f64 {
        interpolated(&self.weights, frequency_hz / self.spacing_hz)
    }
}

/// Centres of the windows: every [`HOP_S`] from the first sample to the last.
pub(crate) fn centres(count: usize, rate_hz: f64) -> Vec<usize> {
    let hop = HOP_S * rate_hz;
    let windows = ((count - 1) as f64 / hop).ceil() as usize + 1;
    (0..windows)
        .map(|k| ((k as f64 * hop).round() as usize).min(count - 1))
        .collect()
}

/// How a series is cut, filtered and put together again.
pub(crate) struct Segments {
    /// Samples of the series per second.
    pub rate_hz: f64,
    /// Number of samples that were measured.
    pub samples: usize,
    /// Entries of the series before the first of them; as many follow the last.
    pub lead: usize,
    /// Entries of the result per sample.
    pub factor: usize,
    /// Entries of the result.
    pub count: usize,
}

/// The stretch of a series around one window's centre, in the Fourier domain.
struct Stretch {
    /// Index of its first sample; negative before the series' start.
    first: i64,
    /// The straight line that was taken off: value at the first sample, and per sample.
    level: f64,
    slope: f64,
    spectrum: Vec<Complex64>,
}

impl Segments {
    /// Derivatives of several orders of a filtered series. Each window's stretch, less a straight
    /// line, continued oddly beyond the ends and tapered, is filtered and differentiated in the
    /// Fourier domain (times `i 2 pi f` for each order); neighbours are cross-faded by raised
    /// cosines.
    pub fn derivatives(
        &self,
        series: &[f64],
        filters: &[Filter],
        gain: &dyn Fn(f64) -> f64,
        orders: &[i32],
    ) -> Vec<Vec<f64>> {
        let half = ((HOP_S + MARGIN_S + TAPER_S) * self.rate_hz).ceil() as usize;
        let forward = FourierPair::new(FourierPair::good_length(2 * half + 1));
        let inverse = FourierPair::new(forward.length() * self.factor);
        let mut results = vec![vec![0.0; self.count]; orders.len()];
        let mut filtered = vec![Complex64::default(); inverse.length()];
        let centres = centres(self.samples, self.rate_hz);
        for (window, (filter, centre)) in filters.iter().zip(centres).enumerate() {
            let stretch = self.stretch(series, centre, half, &forward);
            for (order, result) in orders.iter().zip(&mut results) {
                self.differentiate(&stretch, *order, filter, gain, &mut filtered);
                inverse.inverse(&mut filtered);
                self.add_faded(result, window, &stretch, *order, &filtered);
            }
        }
        results
    }

    /// `half` samples on either side of a centre, less the line between their ends, tapered.
    fn stretch(
        &self,
        series: &[f64],
        centre: usize,
        half: usize,
        transform: &FourierPair,
    ) -> Stretch {
        let first = centre as i64 - half as i64;
        let value = |k: usize| continued(series, first + (k + self.lead) as i64);
        let last = 2 * half;
        let (level, slope) = (value(0), (value(last) - value(0)) / last as f64);
        let mut spectrum = vec![Complex64::default(); transform.length()];
        for (k, slot) in spectrum.iter_mut().enumerate().take(last + 1) {
            let from_edge = k.min(last - k) as f64 / self.rate_hz;
            let taper = if from_edge < TAPER_S {
                0.5 - 0.5 * (PI * from_edge / TAPER_S).cos()
            } else {
                1.0
            };
            *slot = Complex64::new((value(k) - level - slope * k as f64) * taper, 0.0);
        }
        transform.forward(&mut spectrum);
        Stretch {
            first,
            level,
            slope,
            spectrum,
        }
    }

    /// The spectrum of a derivative at the result's rate, into `filtered`.
    fn differentiate(
        &self,
        stretch: &Stretch,
        order: i32,
        filter: &Filter,
        gain: &dyn Fn(f64) -> f64,
        filtered: &mut [Complex64],
    ) {
        let length = stretch.spectrum.len();
        let spacing_hz = self.rate_hz / length as f64;
        let result_length = filtered.len();
        filtered.fill(Complex64::default());
        for k in 0..length.div_ceil(2) {
            let frequency_hz = k as f64 * spacing_hz;
            let weight = filter.at(frequency_hz) * gain(frequency_hz);
            if weight == 0.0 {
                continue;
            }
            let value = stretch.spectrum[k]
                * Complex64::new(0.0, TAU * frequency_hz).powi(order)
                * (weight * self.factor as f64);
            filtered[k] = value;
            if k > 0 {
                filtered[result_length - k] = value.conj();
            }
        }
    }

    /// Adds a window's part of a derivative, and the derivative of the line that was taken off, to
    /// the result.
    fn add_faded(
        &self,
        result: &mut [f64],
        window: usize,
        stretch: &Stretch,
        order: i32,
        filtered: &[Complex64],
    ) {
        let line = |entry: i64| match order {
            0 => {
                stretch.level
                    + stretch.slope * (entry as f64 / self.factor as f64 - stretch.first as f64)
            }
            1 => stretch.slope * self.rate_hz,
            _ => 0.0,
        };
        let hop = HOP_S * self.rate_hz * self.factor as f64;
        // The exact centre, not the sample next to it: the raised cosines add up to 1.
        let middle = window as f64 * hop;
        let from = (middle - hop).ceil().max(0.0) as usize;
        let to = ((middle + hop).floor() as usize).min(self.count - 1);
        for (entry, sum) in result.iter_mut().enumerate().take(to + 1).skip(from) {
            let weight = 0.5 + 0.5 * (PI * (entry as f64 - middle) / hop).cos();
            let place = entry as i64 - stretch.first * self.factor as i64;
            *sum += weight * (filtered[place as usize].re + line(entry as i64));
        }
    }
}

/// A series continued oddly beyond its ends, and level beyond that.
pub(crate) fn continued(series: &[f64], entry: i64) -> f64 {
    let last = series.len() as i64 - 1;
    if entry < 0 {
        2.0 * series[0] - series[(-entry).min(last) as usize]
    } else if entry > last {
        2.0 * series[last as usize] - series[(2 * last - entry).max(0) as usize]
    } else {
        series[entry as usize]
    }
}
