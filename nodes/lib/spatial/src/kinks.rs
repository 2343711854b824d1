//! Where the course of poses has kinks: second differences that come back at a steady rate.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rustfft::num_complex::Complex64;

use crate::golden::greatest_near;
use crate::{FourierPair, PoseSeries, so3};

/// Poses below which no rate is told.
const LEAST_POSES: usize = 200;
/// Intervals of neighbours may differ by this part for a second difference to mean anything. No source.
const UNEVEN: f64 = 0.05;
/// Slowest kinks, Hz: below it motion has a rhythm of its own.
pub(crate) const LEAST_HZ: f64 = 8.0;
/// Slowest repetition that is looked for, Hz. No source.
const LEAST_REPETITION_HZ: f64 = 0.25;
/// Harmonics of a repetition of which the strongest one may be. No source.
const MOST_OF_REPETITION: u32 = 8;
/// How far a rate may be from a multiple of a repetition's, in parts of a line's width. No source.
const HARMONIC_LINES: f64 = 1.5;
/// Half the width of the surroundings that a line is compared with, Hz. No source.
const SURROUNDINGS_HZ: f64 = 2.0;
/// Height of a line over the median of its surroundings from which on it is one: of white noise one in
/// 3e7 entries reaches it.
const LEAST_HEIGHT: f64 = 25.0;
/// Amplitude of a line over the mean energy from which on kinks make it: without noise every ripple
/// stands out. That of the embedded walk at 36 Hz has 0.003, chords in ordinary noise 0.1 and more
/// (`frame_grid_tests.rs`).
const LEAST_MODULATION: f64 = 0.03;
/// Largest energy that counts, over the median one: single jumps have all frequencies. No source.
const LARGEST_ENERGY: f64 = 30.0;

/// Squared second differences of poses, of position and rotation vector each over its median and
/// summed, less their mean; zero where neighbours are missing.
pub(crate) struct Kinks {
    /// Since the first pose.
    seconds: Vec<f64>,
    energy: Vec<f64>,
    /// What was taken off.
    mean: f64,
    /// Of the poses.
    rate_hz: f64,
    stride: usize,
    /// Mean squares of the second differences, per axis: m2, rad2.
    pub mean_squares: [f64; 2],
    /// Up to half the poses' rate, zero-padded, and its spacing, Hz.
    power: Vec<f64>,
    spacing_hz: f64,
}

/// Second differences at a pose from those so many before and after it: of the position, m, and of the
/// rotation vector, rad; none where these are not at equal distances.
pub(crate) fn second_differences(
    poses: &PoseSeries,
    seconds: &[f64],
    k: usize,
    stride: usize,
) -> Option<[Vector3<f64>; 2]> {
    let [a, b, c] = [k - stride, k, k + stride];
    let (before, after) = (seconds[b] - seconds[a], seconds[c] - seconds[b]);
    if (after - before).abs() > UNEVEN * before {
        return None;
    }
    let turn =
        |from: usize, to: usize| so3::log(&(poses.rotations[from].inverse() * poses.rotations[to]));
    Some([
        poses.positions[a] - poses.positions[b] * 2.0 + poses.positions[c],
        turn(b, c) - turn(a, b),
    ])
}

impl Kinks {
    /// From second differences over so many poses: at a kink they are as many times as large, and noise is not. None
    /// for few poses, and where they stand still.
    pub fn new(poses: &PoseSeries, stride: usize) -> Option<Self> {
        let seconds = poses.seconds();
        if seconds.len() < LEAST_POSES {
            return None;
        }
        let mut intervals: Vec<f64> = seconds.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let rate_hz = median(&mut intervals).recip();
        let own = stride..seconds.len() - stride;
        let squares: Vec<Option<[f64; 2]>> = own
            .clone()
            .map(|k| {
                second_differences(poses, &seconds, k, stride)
                    .map(|both| both.map(|d| d.norm_squared()))
            })
            .collect();
        let scale = |of: usize| {
            let mut own: Vec<f64> = squares.iter().flatten().map(|pair| pair[of]).collect();
            median(&mut own)
        };
        let scales = [scale(0), scale(1)];
        let clipped = |pair: &[f64; 2]| -> f64 {
            (0..2)
                .filter(|of| scales[*of] > 0.0)
                .map(|of| (pair[of] / scales[of]).min(LARGEST_ENERGY))
                .sum()
        };
        let there = squares.iter().flatten().count().max(1) as f64;
        let mean = squares.iter().flatten().map(clipped).sum::<f64>() / there;
        let mean_squares = [0, 1]
            .map(|of| squares.iter().flatten().map(|pair| pair[of]).sum::<f64>() / (3.0 * there));
        let energy = squares
            .iter()
            .map(|pair| pair.as_ref().map_or(0.0, |pair| clipped(pair) - mean))
            .collect();
        if !(rate_hz.is_finite() && mean > 0.0) {
            return None;
        }
        let mut kinks = Self {
            seconds: seconds[own].to_vec(),
            energy,
            mean,
            rate_hz,
            stride,
            mean_squares,
            power: Vec::new(),
            spacing_hz: 0.0,
        };
        (kinks.power, kinks.spacing_hz) = kinks.spectrum();
        Some(kinks)
    }

    /// Whether the second differences are those of neighbours.
    pub fn is_of_neighbours(&self) -> bool {
        self.stride == 1
    }

    /// Rate of the poses, Hz.
    pub fn poses_hz(&self) -> f64 {
        self.rate_hz
    }

    /// `sum e exp(-2 pi i hz t)`: its angle tells when the kinks of a rate come.
    pub fn wave(&self, hz: f64) -> Complex64 {
        self.seconds
            .iter()
            .zip(&self.energy)
            .map(|(seconds, energy)| Complex64::from_polar(*energy, -TAU * hz * seconds))
            .sum()
    }

    /// The rate near a coarse one at which kinks come back best, Hz.
    pub fn sharpened(&self, hz: f64) -> f64 {
        let span = self.seconds[self.seconds.len() - 1] - self.seconds[0];
        let power = |hz: f64| self.wave(hz).norm_sqr();
        greatest_near(power, hz, 0.7 / span, 1e-4 / span)
    }

    /// The rate that stands out most, up to half the poses', Hz: that of the kinks, or how it shows
    /// in samples of the poses' rate. None where none stands out.
    pub fn strongest_rate(&self) -> Option<f64> {
        self.strongest_line(LEAST_HZ, f64::INFINITY)
            .filter(|hz| self.are_marked(*hz))
    }

    /// Whether a rate is a multiple of one at which a motion repeats itself: then its harmonics mark it as kinks would.
    pub fn is_harmonic(&self, hz: f64) -> bool {
        let seconds = self.seconds[self.seconds.len() - 1] - self.seconds[0];
        let Some(strongest) = self.strongest_line(LEAST_REPETITION_HZ, LEAST_HZ) else {
            return false;
        };
        let slowest = (strongest / LEAST_REPETITION_HZ) as u32;
        let repetition = (1..=slowest.min(MOST_OF_REPETITION))
            .rev()
            .map(|part| strongest / f64::from(part))
            .find(|hz| self.height_at(*hz) > LEAST_HEIGHT);
        repetition.is_some_and(|own| {
            let off_hz = hz - (hz / own).round() * own;
            off_hz.abs() * seconds < HARMONIC_LINES
        })
    }

    fn strongest_line(&self, from_hz: f64, to_hz: f64) -> Option<f64> {
        let place = |hz: f64| (hz / self.spacing_hz).ceil().min(self.power.len() as f64) as usize;
        let (lowest, end) = (place(from_hz), place(to_hz));
        let around = self.around();
        let mut best = (LEAST_HEIGHT, None);
        for from in (lowest..end).step_by(around) {
            let to = (from + around).min(end);
            let level = level(&self.power, from..to, around, lowest);
            for (k, value) in self.power.iter().enumerate().take(to).skip(from) {
                if value / level > best.0 {
                    best = (value / level, Some(k as f64 * self.spacing_hz));
                }
            }
        }
        best.1.map(|hz| self.sharpened(hz))
    }

    /// Whether kinks of a rate are more than a ripple.
    pub fn are_marked(&self, hz: f64) -> bool {
        self.modulation(hz) > LEAST_MODULATION
    }

    /// Amplitude of a line over the mean energy.
    fn modulation(&self, hz: f64) -> f64 {
        2.0 * self.wave(hz).norm() / (self.energy.len() as f64 * self.mean)
    }

    /// Whether kinks come back at a rate.
    pub fn have_rate(&self, hz: f64) -> bool {
        self.height(hz) > LEAST_HEIGHT && self.are_marked(self.sharpened(hz))
    }

    /// Height of the line that kinks of a rate make, over its surroundings; 0 where none can be seen.
    pub fn height(&self, hz: f64) -> f64 {
        let nyquist_hz = self.rate_hz / 2.0;
        let shown_hz = if hz > nyquist_hz {
            self.rate_hz - hz
        } else {
            hz
        };
        if !(LEAST_HZ..=nyquist_hz).contains(&shown_hz) {
            return 0.0;
        }
        self.height_at(shown_hz)
    }

    fn height_at(&self, hz: f64) -> f64 {
        let k = (hz / self.spacing_hz).round() as usize;
        let peak = self.power[k.saturating_sub(2)..(k + 3).min(self.power.len())]
            .iter()
            .copied()
            .fold(0.0, f64::max);
        peak / level(&self.power, k..k + 1, self.around(), 1)
    }

    fn around(&self) -> usize {
        ((SURROUNDINGS_HZ / self.spacing_hz) as usize).max(20)
    }

    /// Zero-padded spectrum up to half the poses' rate, and its spacing, Hz.
    fn spectrum(&self) -> (Vec<f64>, f64) {
        let first = self.seconds[0];
        let entry = |seconds: f64| ((seconds - first) * self.rate_hz).round() as usize;
        let count = entry(self.seconds[self.seconds.len() - 1]) + 1;
        let size = FourierPair::good_length(2 * count);
        let mut signal = vec![Complex64::default(); size];
        for (seconds, energy) in self.seconds.iter().zip(&self.energy) {
            let index = entry(*seconds);
            // A Hann window, so that the slow course of the motion does not leak.
            let window = 0.5 - 0.5 * (TAU * index as f64 / count as f64).cos();
            signal[index].re = energy * window;
        }
        FourierPair::new(size).forward(&mut signal);
        let power = signal[..=size / 2]
            .iter()
            .map(|value| value.norm_sqr())
            .collect();
        (power, self.rate_hz / size as f64)
    }
}

/// Median of a spectrum around some entries.
fn level(power: &[f64], entries: std::ops::Range<usize>, around: usize, lowest: usize) -> f64 {
    let from = entries
        .start
        .saturating_sub(around)
        .max(lowest)
        .min(power.len() - 1);
    let to = (entries.end + around).min(power.len());
    median(&mut power[from..to].to_vec()).max(f64::MIN_POSITIVE)
}

pub(crate) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
