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

/// A series and how finely its derivatives are wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampling {
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

/// How a series is cut, filtered and put together again; several share it.
pub(crate) struct Segments {
    sampling: Sampling,
    centres: Vec<usize>,
    /// Samples on either side of a centre.
    half: usize,
    forward: FourierPair,
    inverse: FourierPair,
    /// Weights of a stretch's samples from its ends on.
    taper: Vec<f64>,
    /// Gain at each frequency of a stretch.
    gains: Vec<f64>,
    /// Of each window, its first entry of the result and the weights from there on.
    fades: Vec<(usize, Vec<f64>)>,
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
    pub fn new(sampling: Sampling, gain: impl Fn(f64) -> f64) -> Self {
        let Sampling {
            rate_hz,
            samples,
            factor,
            count,
            ..
        } = sampling;
        let half = ((HOP_S + MARGIN_S + TAPER_S) * rate_hz).ceil() as usize;
        let forward = FourierPair::new(FourierPair::good_length(2 * half + 1));
        let length = forward.length();
        let spacing_hz = rate_hz / length as f64;
        let taper = (0..=half)
            .map(|k| k as f64 / rate_hz)
            .take_while(|from_edge| *from_edge < TAPER_S)
            .map(|from_edge| 0.5 - 0.5 * (PI * from_edge / TAPER_S).cos());
        let hop = HOP_S * rate_hz * factor as f64;
        let fade = |window: usize| {
            // The exact centre, not the sample next to it: the raised cosines add up to 1.
            let middle = window as f64 * hop;
            let from = (middle - hop).ceil().max(0.0) as usize;
            let to = ((middle + hop).floor() as usize).min(count - 1);
            let weight = |entry| 0.5 + 0.5 * (PI * (entry as f64 - middle) / hop).cos();
            (from, (from..=to).map(weight).collect())
        };
        let centres = centres(samples, rate_hz);
        Self {
            sampling,
            half,
            inverse: FourierPair::new(length * factor),
            taper: taper.collect(),
            gains: (0..length.div_ceil(2))
                .map(|k| gain(k as f64 * spacing_hz))
                .collect(),
            fades: (0..centres.len()).map(fade).collect(),
            centres,
            forward,
        }
    }

    /// Derivatives of several orders of a filtered series. Each window's stretch, less a straight
    /// line, continued oddly beyond the ends and tapered, is filtered and differentiated in the
    /// Fourier domain (times `i 2 pi f` for each order); neighbours are cross-faded by raised
    /// cosines.
    pub fn derivatives(&self, series: &[f64], filters: &[Filter], orders: &[i32]) -> Vec<Vec<f64>> {
        let mut results = vec![vec![0.0; self.sampling.count]; orders.len()];
        let mut filtered = vec![Complex64::default(); self.inverse.length()];
        for (window, (filter, centre)) in filters.iter().zip(&self.centres).enumerate() {
            let stretch = self.stretch(series, *centre);
            let weights = self.weights(filter);
            for (order, result) in orders.iter().zip(&mut results) {
                self.differentiate(&stretch, *order, &weights, &mut filtered);
                self.inverse.inverse(&mut filtered);
                self.add_faded(result, window, &stretch, *order, &filtered);
            }
        }
        results
    }

    /// A filter's and the gain's together, at each frequency of a stretch.
    fn weights(&self, filter: &Filter) -> Vec<f64> {
        let spacing_hz = self.sampling.rate_hz / self.forward.length() as f64;
        let gains = self.gains.iter().enumerate();
        gains
            .map(|(k, gain)| filter.at(k as f64 * spacing_hz) * gain)
            .collect()
    }

    /// Samples on either side of a centre, less the line between their ends, tapered.
    fn stretch(&self, series: &[f64], centre: usize) -> Stretch {
        let first = centre as i64 - self.half as i64;
        let value = |k: usize| continued(series, first + (k + self.sampling.lead) as i64);
        let last = 2 * self.half;
        let (level, slope) = (value(0), (value(last) - value(0)) / last as f64);
        let mut spectrum = vec![Complex64::default(); self.forward.length()];
        for (k, slot) in spectrum.iter_mut().enumerate().take(last + 1) {
            let taper = self.taper.get(k.min(last - k)).copied().unwrap_or(1.0);
            *slot = Complex64::new((value(k) - level - slope * k as f64) * taper, 0.0);
        }
        self.forward.forward(&mut spectrum);
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
        weights: &[f64],
        filtered: &mut [Complex64],
    ) {
        let Sampling {
            rate_hz, factor, ..
        } = self.sampling;
        let spacing_hz = rate_hz / stretch.spectrum.len() as f64;
        let result_length = filtered.len();
        filtered.fill(Complex64::default());
        for (k, &weight) in weights.iter().enumerate() {
            if weight == 0.0 {
                continue;
            }
            let value = stretch.spectrum[k]
                * Complex64::new(0.0, TAU * (k as f64 * spacing_hz)).powi(order)
                * (weight * factor as f64);
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
        let Sampling {
            rate_hz, factor, ..
        } = self.sampling;
        let line = |entry: i64| match order {
            0 => {
                stretch.level
                    + stretch.slope * (entry as f64 / factor as f64 - stretch.first as f64)
            }
            1 => stretch.slope * rate_hz,
            _ => 0.0,
        };
        let (from, weights) = &self.fades[window];
        for (entry, (sum, weight)) in result[*from..].iter_mut().zip(weights).enumerate() {
            let entry = (from + entry) as i64;
            let place = entry - stretch.first * factor as i64;
            *sum += weight * (filtered[place as usize].re + line(entry));
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
