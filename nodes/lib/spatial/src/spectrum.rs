//! Fourier transforms and power spectra.

use std::cell::RefCell;
use std::f64::consts::TAU;
use std::sync::Arc;

use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftDirection, FftPlanner};

/// One-sided power spectral density on a uniform grid of frequencies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// Distance of two frequencies, Hz; entry k belongs to `k spacing_hz`.
    pub spacing_hz: f64,
    /// Density, (unit of the series)^2/Hz; its sum times the spacing is the variance.
    pub density: Vec<f64>,
    /// How many windows were averaged.
    pub windows: usize,
}

impl Spectrum {
    /// Density at a frequency by linear interpolation; held at the ends.
    pub fn at(&self, frequency_hz: f64) -> f64 {
        interpolated(&self.density, frequency_hz / self.spacing_hz)
    }

    /// Frequency of an entry, Hz.
    pub fn frequency(&self, index: usize) -> f64 {
        index as f64 * self.spacing_hz
    }

    /// The entries between two frequencies, Hz.
    pub fn band(&self, from_hz: f64, to_hz: f64) -> &[f64] {
        let index =
            |hz: f64| ((hz / self.spacing_hz).round().max(0.0) as usize).min(self.density.len());
        let (from, to) = (index(from_hz), index(to_hz));
        &self.density[from.min(to)..to]
    }

    /// Mean density between two frequencies, Hz, with weights of a power of the frequency; the density in their middle
    /// where no entry lies between.
    pub fn weighted_mean(&self, from_hz: f64, to_hz: f64, power: i32) -> f64 {
        let first = (from_hz / self.spacing_hz).ceil().max(1.0) as usize;
        let last = ((to_hz / self.spacing_hz) as usize).min(self.density.len().saturating_sub(1));
        let (mut sum, mut weights) = (0.0, 0.0);
        for k in first..=last {
            let weight = self.frequency(k).powi(power);
            sum += weight * self.density[k];
            weights += weight;
        }
        if weights > 0.0 {
            sum / weights
        } else {
            self.at(0.5 * (from_hz + to_hz))
        }
    }

    /// Median of the density between two frequencies, Hz.
    pub fn median(&self, from_hz: f64, to_hz: f64) -> Option<f64> {
        let mut values = self.band(from_hz, to_hz).to_vec();
        values.sort_unstable_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    }
}

/// Value of a series between its entries; held at the ends.
pub(crate) fn interpolated(values: &[f64], position: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else {
        return 0.0;
    };
    let position = position.clamp(0.0, last as f64);
    let index = (position as usize).min(last.saturating_sub(1));
    let share = position - index as f64;
    values[index] * (1.0 - share) + values[(index + 1).min(last)] * share
}

/// Welch's estimate (1967) with Hann windows that overlap by half; each window's straight line is
/// taken off first.
///
/// A series shorter than the window is one window. Resolution: 1.5 / window length.
pub fn welch(series: &[f64], rate_hz: f64, window: usize) -> Spectrum {
    let window = window.min(series.len()).max(2);
    let hann: Vec<f64> = (0..window)
        .map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / window as f64).cos())
        .collect();
    let power: f64 = hann.iter().map(|weight| weight * weight).sum();
    let fft = planned(window, FftDirection::Forward);
    let mut density = vec![0.0; window / 2 + 1];
    let mut buffer = vec![Complex64::default(); window];
    let mut windows = 0;
    let mut start = 0;
    while start + window <= series.len() {
        let part = &series[start..start + window];
        let (level, slope) = line(part);
        for (k, entry) in buffer.iter_mut().enumerate() {
            *entry = Complex64::new((part[k] - level - slope * k as f64) * hann[k], 0.0);
        }
        fft.process(&mut buffer);
        for (sum, entry) in density.iter_mut().zip(&buffer) {
            *sum += entry.norm_sqr();
        }
        windows += 1;
        start += (window / 2).max(1);
    }
    let factor = 2.0 / (rate_hz * power * windows.max(1) as f64);
    density.iter_mut().for_each(|value| *value *= factor);
    Spectrum {
        spacing_hz: rate_hz / window as f64,
        density,
        windows,
    }
}

/// Level at the first entry and slope per entry of the least-squares line.
fn line(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let centre = (n - 1.0) / 2.0;
    let mean = values.iter().sum::<f64>() / n;
    let spread = n * (n * n - 1.0) / 12.0;
    let slope = if spread > 0.0 {
        values
            .iter()
            .enumerate()
            .map(|(k, v)| (k as f64 - centre) * v)
            .sum::<f64>()
            / spread
    } else {
        0.0
    };
    (mean - slope * centre, slope)
}

thread_local! {
    /// Plans cost as much as a few transforms, and the same lengths come again and again.
    static PLANNER: RefCell<FftPlanner<f64>> = RefCell::new(FftPlanner::new());
}

fn planned(length: usize, direction: FftDirection) -> Arc<dyn Fft<f64>> {
    PLANNER.with_borrow_mut(|planner| planner.plan_fft(length, direction))
}

/// Forward and inverse transforms of one length; the inverse divides by it.
#[derive(Clone)]
pub struct FourierPair {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    length: usize,
}

impl std::fmt::Debug for FourierPair {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "FourierPair({})", self.length)
    }
}

impl FourierPair {
    /// Plans both transforms of series of `length` entries.
    pub fn new(length: usize) -> Self {
        Self {
            forward: planned(length, FftDirection::Forward),
            inverse: planned(length, FftDirection::Inverse),
            length,
        }
    }

    /// Entries of a series that is transformed.
    pub fn length(&self) -> usize {
        self.length
    }

    /// `X_k = sum_n x_n exp(-2 pi i k n / length)`, in place.
    pub fn forward(&self, values: &mut [Complex64]) {
        self.forward.process(values);
    }

    /// The inverse of [`FourierPair::forward`], divided by the length, in place.
    pub fn inverse(&self, values: &mut [Complex64]) {
        self.inverse.process(values);
        let factor = 1.0 / self.length as f64;
        values.iter_mut().for_each(|value| *value *= factor);
    }

    /// A convenient length of at least `least`: 2^a 3^b 5^c.
    pub fn good_length(least: usize) -> usize {
        let mut best = least.max(1).next_power_of_two();
        let mut five = 1;
        while five < best {
            let mut three = five;
            while three < best {
                let rest = least.div_ceil(three).next_power_of_two() * three;
                if rest >= least && rest < best {
                    best = rest;
                }
                three *= 3;
            }
            five *= 5;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_and_its_power_are_found() {
        let rate_hz = 100.0;
        let series: Vec<f64> = (0..6000)
            .map(|k| 3.0 * (TAU * 7.0 * f64::from(k) / rate_hz).sin())
            .collect();
        let spectrum = welch(&series, rate_hz, 500);
        let power: f64 = spectrum.density.iter().sum::<f64>() * spectrum.spacing_hz;
        assert!((power - 4.5).abs() < 0.02, "{power}");
        let peak = (0..spectrum.density.len())
            .max_by(|&a, &b| spectrum.density[a].total_cmp(&spectrum.density[b]))
            .unwrap_or(0);
        assert!((spectrum.frequency(peak) - 7.0).abs() <= spectrum.spacing_hz);
    }

    #[test]
    fn lengths_have_small_factors() {
        for least in [1, 7, 97, 6001, 12289] {
            let mut length = FourierPair::good_length(least);
            assert!(length >= least && length < 2 * least.max(2));
            for factor in [2, 3, 5] {
                while length.is_multiple_of(factor) {
                    length /= factor;
                }
            }
            assert_eq!(length, 1);
        }
    }
}
