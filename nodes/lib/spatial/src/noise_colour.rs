//! Noise of poses that is not white, learnt from what a smoothing spline leaves of the samples.
//!
//! A spline takes what lies beyond its cutoff for noise, and noise for white: what comes through within the band
//! is stated as dense as what was taken off beyond. That holds for noise that is independent from sample to sample. A
//! tracker that filters its poses leaves next to nothing at high frequencies, and errors with a memory are
//! denser at low ones: then far more comes through. With H the spline's response and S the density of its residuals,
//! the noise's density is
//!
//! ```text
//! N(f) = S(f) / mean of (1 - H(f, t))        H = 1 / (1 + (f / cutoff(t))^10)
//! ```
//! since Wiener's filter leaves N (1 - H). It is the median over stretches of a second, so that impacts and bursts,
//! whose motion is left too, do not count, and carried on below the lowest frequency that enough of them
//! show as noise with a memory of the first order (AR(1)) or behind a Gaussian filter has it, where one of them explains the rest.

use std::f64::consts::PI;

use crate::kinks::median;
use crate::noise_shape::first_order;
use crate::spectrum::interpolated;

/// Correlations of residuals up to this many samples apart, and frequencies from 0 to half the rate in as many
/// steps. Chosen among 16 and 24 on the motions of `tests/noise_colour.rs`, where a Gaussian's corner came out up to a tenth too high with 16.
const LAGS: usize = 24;
const FREQUENCIES: usize = LAGS + 1;
/// Length of a stretch, s, and in samples at least, so that all lags are seen often. No source.
const STRETCH_S: f64 = 1.0;
const LEAST_STRETCH: usize = 4 * LAGS;
/// Stretches that are looked at, evenly over the samples, at most: more would say nothing new; and at least. No source.
const MOST_STRETCHES: usize = 64;
const FEWEST_STRETCHES: usize = 4;
/// Part of the stretches that has to show a frequency. No source.
const LEAST_PART: f64 = 0.2;
/// What the smoothing leaves of a frequency that it shows, at least. Chosen among 0.7 and 0.9 on the same motions.
const LEAST_LEFT: f64 = 0.9;
/// How many of the lowest frequencies that are shown are compared with the upper half of the band, and what they
/// have of its median at least where noise is not white. White noise of 240 bodies (`evaluate fidelity`, markers at 30,
/// 60 and 120 Hz) had 0.7 to 1.9, 97 % of it up to 1.3, that of ten trials whose optical system filters its poses (BROAD) 2.8 to 790.
const LOWEST_SHOWN: usize = 3;
const LEAST_EXCESS: f64 = 2.0;
/// A level is clear of the floor, the upper half's median, where it is so many times as high; and so many that are show a
/// Gaussian filter. No source.
const CLEAR: f64 = 4.0;
const FEWEST_CLEAR: usize = 3;
/// Part of the lowest frequency's level below which differences do not count: a filter leaves nothing there. No source.
const DARKEST: f64 = 1e-4;
/// How much of an error is left in the next, of noise with a memory. Of a longer one than the last, how long it is does not show.
const MEMORIES: [f64; 18] = [
    0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85,
    0.9,
];
/// Mean square misfit of the levels' logarithms up to which a memory explains them. No source.
const MEMORY_MISFIT: f64 = 0.05;
/// Cutoffs that are tabled, in half steps of the frequencies.
const CUTOFFS: usize = 2 * LAGS + 1;
/// Steps of the integrals in the table, and their end in cutoffs, where next to nothing comes through.
const STEPS: usize = 32;
const END: f64 = 1.4;

/// What a spline leaves of stretches of its samples.
#[derive(Clone, Debug, Default)]
pub(crate) struct ResidualSpectra {
    /// Densities of the noise that the stretches show, frequency by frequency, as variances of white noise as dense.
    shown: [Vec<f64>; FREQUENCIES],
    stretches: usize,
}

/// Variance of white noise that leaves as much in a derivative, by the cutoff.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NoiseColour {
    /// Of value, first and second derivative.
    levels: [[f64; CUTOFFS]; 3],
    /// Standard deviation of the Gaussian kernel that the samples were smoothed with, in sample intervals; none where the noise does
    /// not fall as behind one.
    pub(crate) kernel: Option<f64>,
}

/// Stretches of so many samples that are looked at: where each begins, and how long all are; none of too few.
pub(crate) fn stretches(
    count: usize,
    interval: f64,
) -> Option<(impl Iterator<Item = usize>, usize)> {
    let length = ((STRETCH_S / interval) as usize).max(LEAST_STRETCH);
    let all = count / length;
    let looked_at = all.min(MOST_STRETCHES);
    (all >= FEWEST_STRETCHES).then(|| {
        (
            (0..looked_at).map(move |k| k * all / looked_at * length),
            length,
        )
    })
}

impl ResidualSpectra {
    /// Adds a stretch: residuals at constant steps, and the spline's cutoffs there, in half the samples' rate.
    pub(crate) fn add<const C: usize>(&mut self, residuals: &[[f64; C]], cutoffs: &[f64]) {
        self.stretches += 1;
        let correlations: [f64; FREQUENCIES] = std::array::from_fn(|lag| {
            let pairs = residuals.iter().zip(&residuals[lag..]);
            let sum: f64 = pairs
                .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>())
                .sum();
            sum / ((residuals.len() - lag) * C) as f64
        });
        for (k, shown) in self.shown.iter_mut().enumerate() {
            let part = k as f64 / LAGS as f64;
            let passed = |cutoff: &f64| 1.0 / (1.0 + (part / cutoff).powi(10));
            let left = 1.0 - cutoffs.iter().map(passed).sum::<f64>() / cutoffs.len() as f64;
            if left > LEAST_LEFT {
                shown.push(density(&correlations, part).max(0.0) / left);
            }
        }
    }

    /// The noise, where it is not white.
    pub(crate) fn colour(self) -> Option<NoiseColour> {
        let least = ((LEAST_PART * self.stretches as f64) as usize).max(FEWEST_STRETCHES);
        let levels = self
            .shown
            .map(|mut shown| (shown.len() >= least).then(|| median(&mut shown)));
        let first = levels.iter().position(Option::is_some)?;
        let shown: Vec<f64> = levels[first..].iter().copied().collect::<Option<_>>()?;
        let upper = (FREQUENCIES / 2).checked_sub(first)?;
        if upper < LOWEST_SHOWN {
            return None;
        }
        let low = shown[..LOWEST_SHOWN].iter().sum::<f64>() / LOWEST_SHOWN as f64;
        let floor = median(&mut shown[upper..].to_vec());
        (low > LEAST_EXCESS * floor).then(|| {
            NoiseColour::of(&Shown {
                first,
                levels: &shown,
                floor,
            })
        })
    }
}

/// Variance of white noise as dense as a series of these correlations at a part of half its rate, with Hann's window over the lags.
fn density(correlations: &[f64; FREQUENCIES], part: f64) -> f64 {
    let lags = correlations.iter().enumerate().skip(1);
    let both_sides = lags.map(|(lag, value)| {
        let lag = lag as f64;
        let hann = 0.5 + 0.5 * (PI * lag / FREQUENCIES as f64).cos();
        2.0 * hann * value * (PI * part * lag).cos()
    });
    correlations[0] + both_sides.sum::<f64>()
}

impl NoiseColour {
    fn of(shown: &Shown) -> Self {
        let shape = shown.shape();
        let level = |order: usize, k: usize| {
            let cutoff = 0.5 * k.max(1) as f64 / LAGS as f64;
            let (mut sum, mut weights) = (0.0, 0.0);
            for step in 0..STEPS {
                let x = END * (step as f64 + 0.5) / STEPS as f64;
                let weight = x.powi(2 * order as i32) / (1.0 + x.powi(10)).powi(2);
                sum += weight * shown.at(x * cutoff, shape);
                weights += weight;
            }
            sum / weights
        };
        Self {
            levels: std::array::from_fn(|order| std::array::from_fn(|k| level(order, k))),
            kernel: match shape {
                Shape::Gaussian { fall, .. } => Some(fall.sqrt() / PI),
                Shape::Memory { .. } | Shape::Unknown { .. } => None,
            },
        }
    }

    /// Of the derivative of an order behind a spline of this cutoff, in half the samples' rate.
    #[inline]
    pub(crate) fn level(&self, order: i32, cutoff: f64) -> f64 {
        interpolated(&self.levels[order as usize], cutoff * 2.0 * LAGS as f64)
    }
}

/// The noise from the lowest frequency that enough stretches show on.
struct Shown<'a> {
    first: usize,
    levels: &'a [f64],
    /// Median of the upper half of the band.
    floor: f64,
}

/// What has made the noise so, by a part f of half the rate.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// `level exp(-fall f^2)` and a floor: the poses were smoothed with a Gaussian kernel.
    Gaussian { level: f64, fall: f64 },
    /// AR(1), so much of an error is left in the next; the level is the mean over all frequencies.
    Memory { level: f64, left: f64 },
    /// As dense at low frequencies as at the lowest that is shown.
    Unknown { level: f64 },
}

impl Shape {
    /// Density, without a floor.
    fn density(self, part: f64) -> f64 {
        match self {
            Self::Gaussian { level, fall } => level * (-fall * part * part).exp(),
            Self::Memory { level, left } => level * first_order(left, part),
            Self::Unknown { level } => level,
        }
    }
}

impl Shown<'_> {
    fn part(&self, k: usize) -> f64 {
        (self.first + k) as f64 / LAGS as f64
    }

    /// Below what is shown the shape goes on.
    fn at(&self, part: f64, shape: Shape) -> f64 {
        let lowest = self.part(0);
        if part < lowest {
            return shape.density(part);
        }
        interpolated(self.levels, (part - lowest) * LAGS as f64)
    }

    /// That which explains the levels, in their logarithms.
    fn shape(&self) -> Shape {
        let floor = self.floor.max(DARKEST * self.levels[0]);
        // Mean and variance of how far the levels are from a density.
        let apart = |density: &dyn Fn(f64) -> f64| {
            let apart: Vec<f64> = (0..self.levels.len())
                .map(|k| (self.levels[k].max(floor) / density(self.part(k))).ln())
                .collect();
            let count = apart.len() as f64;
            let mean = apart.iter().sum::<f64>() / count;
            let squares = apart.iter().map(|it| (it - mean).powi(2));
            [mean, squares.sum::<f64>() / count]
        };
        let memories = MEMORIES.map(|left| (apart(&|part| first_order(left, part)), left));
        let memory = memories
            .into_iter()
            .min_by(|a, b| a.0[1].total_cmp(&b.0[1]));
        let ([level, of_memory], left) = memory.unwrap_or(([0.0, f64::INFINITY], 0.0));
        if let Some(gaussian) = self.gaussian(floor)
            && apart(&|part| gaussian.density(part) + floor)[1] < of_memory
        {
            return gaussian;
        }
        if of_memory < MEMORY_MISFIT && left < MEMORIES[MEMORIES.len() - 1] {
            let level = level.exp();
            return Shape::Memory { level, left };
        }
        let level = self.levels[0];
        Shape::Unknown { level }
    }

    /// The Gaussian filter whose noise goes through the levels that are clear of the floor.
    fn gaussian(&self, floor: f64) -> Option<Shape> {
        let clear = self
            .levels
            .iter()
            .take_while(|level| **level > CLEAR * floor);
        let points: Vec<[f64; 2]> = clear
            .enumerate()
            .map(|(k, level)| [self.part(k).powi(2), (level - floor).ln()])
            .collect();
        if points.len() < FEWEST_CLEAR {
            return None;
        }
        let count = points.len() as f64;
        let mean = |of: usize| points.iter().map(|point| point[of]).sum::<f64>() / count;
        let (x, y) = (mean(0), mean(1));
        let apart = points.iter().map(|point| [point[0] - x, point[1] - y]);
        let [products, squares] = apart.fold([0.0; 2], |[products, squares], [dx, dy]| {
            [products + dx * dy, squares + dx * dx]
        });
        let slope = products / squares;
        (slope < 0.0).then(|| Shape::Gaussian {
            level: (y - slope * x).exp(),
            fall: -slope,
        })
    }
}
