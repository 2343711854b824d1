//! The line of a residual's spectrum that stands out most.

use std::f64::consts::TAU;

use cromosim_spatial::{Complex64, FourierPair, greatest_near};
use nalgebra::Vector3;

use super::residual_view::{ResidualView, median};
use super::wave::{SpectralLine, Wave};
use crate::{Channel, PerChannel};

/// Readings below which no line is looked for.
const LEAST_READINGS: usize = 64;
/// Least frequency that is looked at, Hz: below it the residual of motion lives.
const LEAST_HZ: f64 = 2.0;
/// Half the width of the surroundings that a line is compared with, Hz.
const SURROUNDINGS_HZ: f64 = 1.0;
/// To this the frequency is found, Hz: a hundredth of a turn in ten minutes.
const PRECISION_HZ: f64 = 1e-5;
/// Longest transform.
const MOST_ENTRIES: usize = 1 << 24;

/// The line that stands out most over its surroundings in both channels together, with amplitudes
/// and phases by least squares in absolute time.
pub fn strongest_line(view: &ResidualView) -> Option<SpectralLine> {
    let count = view.stamps.len().min(view.measured.len());
    if count < LEAST_READINGS || view.rate_hz.is_nan() || view.rate_hz <= 0.0 {
        return None;
    }
    let centred = Centred::new(view);
    let spectra = centred.spectra(view.rate_hz)?;
    let (coarse_hz, level) = spectra.highest()?;
    let power = |hz: f64| {
        let waves = centred.waves(hz);
        Channel::ALL
            .map(|channel| waves[channel].norm_squared() / level[channel])
            .iter()
            .sum()
    };
    let hz = greatest_near(power, coarse_hz, spectra.spacing_hz, PRECISION_HZ);
    Some(SpectralLine {
        hz,
        waves: centred.waves(hz),
    })
}

/// A residual of both channels, less its means.
struct Centred {
    /// Since the epoch.
    seconds: Vec<f64>,
    residual: PerChannel<Vec<Vector3<f64>>>,
}

impl Centred {
    fn new(view: &ResidualView) -> Self {
        Self {
            seconds: view
                .stamps
                .iter()
                .map(|stamp| *stamp - view.epoch)
                .collect(),
            residual: PerChannel::from_fn(|channel| {
                let mut residual: Vec<Vector3<f64>> = view.residual(channel).collect();
                let mean = residual.iter().sum::<Vector3<f64>>() / residual.len() as f64;
                residual.iter_mut().for_each(|value| *value -= mean);
                residual
            }),
        }
    }

    /// Waves of one frequency by least squares.
    fn waves(&self, hz: f64) -> PerChannel<Wave> {
        let (mut ss, mut sc, mut cc) = (0.0, 0.0, 0.0);
        let mut sums = PerChannel::<Wave>::default();
        let [accel, gyro] = Channel::ALL.map(|channel| &self.residual[channel]);
        for (seconds, (accel, gyro)) in self.seconds.iter().zip(accel.iter().zip(gyro)) {
            let (sin, cos) = (TAU * hz * seconds).sin_cos();
            (ss, sc, cc) = (ss + sin * sin, sc + sin * cos, cc + cos * cos);
            sums.accelerometer.add(accel, sin, cos);
            sums.gyroscope.add(gyro, sin, cos);
        }
        let determinant = ss * cc - sc * sc;
        PerChannel::from_fn(|channel| {
            let Wave { sine, cosine } = sums[channel];
            Wave {
                sine: (sine * cc - cosine * sc) / determinant,
                cosine: (cosine * ss - sine * sc) / determinant,
            }
        })
    }

    /// Zero-padded spectra of both channels, each summed over its axes; none where the stamps span
    /// too much.
    fn spectra(&self, rate_hz: f64) -> Option<Spectra> {
        let first = *self.seconds.first()?;
        let entry = |seconds: f64| ((seconds - first) * rate_hz).round().max(0.0) as usize;
        let count = entry(*self.seconds.last()?) + 1;
        let size = (2 * count).next_power_of_two();
        if size > MOST_ENTRIES {
            return None;
        }
        let transform = FourierPair::new(size);
        let mut power = PerChannel::from_fn(|_| vec![0.0; size / 2]);
        let axes = |axis: usize| (Channel::ALL[axis / 3], axis % 3);
        // Two axes at once, as real and imaginary part.
        for pair in [[0, 1], [3, 4], [2, 5]] {
            let [(first, i), (second, j)] = pair.map(axes);
            let mut signal = vec![Complex64::default(); size];
            for (k, seconds) in self.seconds.iter().enumerate() {
                let index = entry(*seconds);
                // A Hann window, so that strong motion does not leak over the line.
                let window = 0.5 - 0.5 * (TAU * index as f64 / count as f64).cos();
                signal[index.min(size - 1)] = Complex64::new(
                    self.residual[first][k][i] * window,
                    self.residual[second][k][j] * window,
                );
            }
            transform.forward(&mut signal);
            for k in 1..size / 2 {
                let (here, there) = (signal[k], signal[size - k].conj());
                power[first][k] += 0.25 * (here + there).norm_sqr();
                power[second][k] += 0.25 * (here - there).norm_sqr();
            }
        }
        Some(Spectra {
            spacing_hz: rate_hz / size as f64,
            power,
        })
    }
}

impl Wave {
    fn add(&mut self, value: &Vector3<f64>, sin: f64, cos: f64) {
        self.sine += value * sin;
        self.cosine += value * cos;
    }

    fn norm_squared(&self) -> f64 {
        self.sine.norm_squared() + self.cosine.norm_squared()
    }
}

struct Spectra {
    spacing_hz: f64,
    power: PerChannel<Vec<f64>>,
}

impl Spectra {
    /// The frequency at which the channels' heights over their surroundings have the greatest sum,
    /// and the levels of these surroundings.
    fn highest(&self) -> Option<(f64, PerChannel<f64>)> {
        let bins = self.power.accelerometer.len();
        let around = ((SURROUNDINGS_HZ / self.spacing_hz) as usize).max(20);
        let lowest = ((LEAST_HZ / self.spacing_hz).ceil() as usize).max(1);
        let mut best = None;
        let mut highest = 0.0;
        for from in (lowest..bins).step_by(around) {
            let to = (from + around).min(bins);
            let level = PerChannel::from_fn(|channel| {
                let surroundings =
                    from.saturating_sub(around / 2).max(lowest)..(to + around / 2).min(bins);
                let mut neighbours = self.power[channel][surroundings].to_vec();
                median(&mut neighbours).max(f64::MIN_POSITIVE)
            });
            for k in from..to {
                let height: f64 = Channel::ALL
                    .map(|channel| self.power[channel][k] / level[channel])
                    .iter()
                    .sum();
                if height > highest {
                    highest = height;
                    best = Some((k as f64 * self.spacing_hz, level));
                }
            }
        }
        best
    }
}
