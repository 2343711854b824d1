//! Filters that change over time, and derivatives through them.

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex64;

use crate::FourierPair;
use crate::spectrum::interpolated;

/// Distance of the windows' centres, s; each is cross-faded with its neighbours over this time.
pub(crate) const HOP_S: f64 = 2.0;
/// What is taken beyond the cross-fade on either side, s: room for the filter's response, then a
/// taper.
const MARGIN_S: f64 = 1.0;
const TAPER_S: f64 = 1.5;

/// A zero-phase filter by its weights at evenly spaced frequencies.
#[derive(Clone, Debug)]
pub(crate) struct Filter {
    pub spacing_hz: f64,
    pub weights: Vec<f64>,
}

impl Filter {
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
    /// Of the series.
    pub rate_hz: f64,
    /// Samples, and entries of the series before the first of them (as many follow the last).
    pub samples: usize,
    pub lead: usize,
    /// Entries of the result per sample.
    pub factor: usize,
    /// Entries of the result.
    pub count: usize,
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
        let length = FourierPair::good_length(2 * half + 1);
        let forward = FourierPair::new(length);
        let inverse = FourierPair::new(length * self.factor);
        let spacing_hz = self.rate_hz / length as f64;
        let mut results = vec![vec![0.0; self.count]; orders.len()];
        let mut values = vec![Complex64::default(); length];
        let mut filtered = vec![Complex64::default(); inverse.length()];
        for (window, (filter, centre)) in filters
            .iter()
            .zip(centres(self.samples, self.rate_hz))
            .enumerate()
        {
            let first = centre as i64 - half as i64;
            let value = |k: usize| continued(series, first + (k + self.lead) as i64);
            let last = 2 * half;
            let (level, slope) = (value(0), (value(last) - value(0)) / last as f64);
            values.fill(Complex64::default());
            for (k, slot) in values.iter_mut().enumerate().take(last + 1) {
                let from_edge = k.min(last - k) as f64 / self.rate_hz;
                let taper = if from_edge < TAPER_S {
                    0.5 - 0.5 * (PI * from_edge / TAPER_S).cos()
                } else {
                    1.0
                };
                *slot = Complex64::new((value(k) - level - slope * k as f64) * taper, 0.0);
            }
            forward.forward(&mut values);
            for (order, result) in orders.iter().zip(&mut results) {
                filtered.fill(Complex64::default());
                for k in 0..length.div_ceil(2) {
                    let frequency_hz = k as f64 * spacing_hz;
                    let weight = filter.at(frequency_hz) * gain(frequency_hz);
                    if weight == 0.0 {
                        continue;
                    }
                    let value = values[k]
                        * Complex64::new(0.0, TAU * frequency_hz).powi(*order)
                        * (weight * self.factor as f64);
                    filtered[k] = value;
                    if k > 0 {
                        filtered[inverse.length() - k] = value.conj();
                    }
                }
                inverse.inverse(&mut filtered);
                let line = |entry: i64| match order {
                    0 => level + slope * (entry as f64 / self.factor as f64 - first as f64),
                    1 => slope * self.rate_hz,
                    _ => 0.0,
                };
                let hop = HOP_S * self.rate_hz * self.factor as f64;
                // The exact centre, not the sample next to it: the raised cosines add up to 1.
                let middle = window as f64 * hop;
                let from = (middle - hop).ceil().max(0.0) as usize;
                let to = ((middle + hop).floor() as usize).min(self.count - 1);
                for (entry, sum) in result.iter_mut().enumerate().take(to + 1).skip(from) {
                    let weight = 0.5 + 0.5 * (PI * (entry as f64 - middle) / hop).cos();
                    let place = entry as i64 - first * self.factor as i64;
                    *sum += weight * (filtered[place as usize].re + line(entry as i64));
                }
            }
        }
        results
    }
}

/// A series continued oddly beyond its ends, and level beyond that.
fn continued(series: &[f64], entry: i64) -> f64 {
    let last = series.len() as i64 - 1;
    if entry < 0 {
        2.0 * series[0] - series[(-entry).min(last) as usize]
    } else if entry > last {
        2.0 * series[last as usize] - series[(2 * last - entry).max(0) as usize]
    } else {
        series[entry as usize]
    }
}
