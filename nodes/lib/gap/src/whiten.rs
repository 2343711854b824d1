//! The noise that a residual should have, and residuals in units of it.

use std::f64::consts::TAU;
use std::sync::Arc;

use cromosim_imu::{Reading, ResidualView, STANDARD_GRAVITY};
use cromosim_spatial::{Complex64, FourierPair, PoseEstimate, Spectrum, welch};

use crate::fill::Filler;
use crate::problem::{Problem, axis_of};

/// Share of the motion from which on a frequency counts as resolved by the reference.
const RESOLVED: f64 = 0.9;
/// Length of the windows of residual spectra, s.
const WINDOW_S: f64 = 4.0;

/// Predicted noise of a residual: white noise of the sensor and the reference's own error.
///
/// One-sided densities, with N_p, N_r the error densities of the pose estimate, l the lever arm, s
/// = (2 pi f)^2, and the motion's mean squares of specific force f2 and angular velocity w2 (an
/// error of the rotation turns both vectors, whatever its frequency):
/// ```text
/// accelerometer  2 sigma_a^2 / fs + s^2 N_p + 2/3 f2 N_r + 2/3 |l|^2 (s^2 + 3 s w2 + w2^2) N_r + lost_a(f)
/// gyroscope      2 sigma_g^2 / fs + (s + 2/3 w2) N_r + lost_g(f)
/// ```
/// `lost` is motion that drowns in the reference's noise, as the residual itself shows it above the
/// band that the reference resolves; it is never taken for larger than that noise allows.
#[derive(Clone, Debug)]
pub(crate) struct NoiseModel {
    /// Two-sided per-sample variance spectra (density times rate / 2) at the transform's
    /// frequencies.
    pub power: [Vec<f64>; 2],
    pub spacing_hz: f64,
}

/// What the noise of a residual is predicted from.
#[derive(Clone, Debug)]
pub(crate) struct NoiseBasis {
    /// White noise per sample: accelerometer, gyroscope.
    pub sigma: [f64; 2],
    /// Length of the lever arm, m.
    pub lever_arm_m: f64,
    /// Of the reference's motion.
    pub estimate: Arc<PoseEstimate>,
    /// Cutoff of the reference's smoothing that the estimate undoes.
    pub undone_hz: Option<f64>,
    /// Mean square of the angular velocity, rad2/s2.
    pub rate_squared: f64,
    /// Mean square of the specific force, m2/s4.
    pub force_squared: f64,
    /// A line that may be a vibration.
    pub line_hz: Option<f64>,
    /// Steps of quantisation in units of the white noise: rounding errors of slow motion are no
    /// white noise.
    pub steps: [f64; 2],
    /// Shares of the reference's noise densities that are taken: position, rotation.
    pub reference_share: [f64; 2],
}

impl NoiseBasis {
    pub fn new(estimate: PoseEstimate, sigma: [f64; 2]) -> Self {
        Self {
            sigma,
            lever_arm_m: 0.0,
            estimate: Arc::new(estimate),
            undone_hz: None,
            rate_squared: 0.0,
            force_squared: STANDARD_GRAVITY.powi(2),
            line_hz: None,
            steps: [0.0; 2],
            reference_share: [1.0; 2],
        }
    }
}

/// One-sided densities at a frequency, by channel.
struct Expected {
    /// Sensor noise and the error of the estimate.
    known: [f64; 2],
    /// Most that motion which the estimate leaves out can be.
    hidden: [f64; 2],
    /// Share of the motion that the estimate keeps.
    through: [f64; 2],
}

impl NoiseBasis {
    fn expected(
        &self,
        frequency_hz: f64,
        rate_hz: f64,
        (position, rotation): &(Spectrum, Spectrum),
    ) -> Expected {
        let squared = (TAU * frequency_hz).powi(2);
        let (error_p, error_r) = self.estimate.error_density(frequency_hz);
        let (error_p, error_r) = (
            error_p * self.reference_share[0],
            error_r * self.reference_share[1],
        );
        let (through_p, through_r, gain) = self.estimate.filter_at(frequency_hz);
        let (lever2, w2, f2) = (
            self.lever_arm_m * self.lever_arm_m,
            self.rate_squared,
            self.force_squared,
        );
        let lever = 2.0 / 3.0 * lever2 * (squared * squared + 3.0 * squared * w2 + w2 * w2);
        let white = self.sigma.map(|sigma| 2.0 * sigma * sigma / rate_hz);
        let known = [
            white[0] + squared * squared * error_p + (2.0 / 3.0 * f2 + lever) * error_r,
            white[1] + (squared + 2.0 / 3.0 * w2) * error_r,
        ];
        // Motion below the reference's noise: at most that noise itself.
        let hidden_p =
            squared * squared * position.at(frequency_hz) * (1.0 - through_p) * gain * gain;
        let hidden_r = squared * rotation.at(frequency_hz) * (1.0 - through_r) * gain * gain;
        let hidden = [hidden_p + 2.0 / 3.0 * lever2 * squared * hidden_r, hidden_r];
        let through = [
            if lever2 > 0.0 {
                through_p.min(through_r)
            } else {
                through_p
            },
            through_r,
        ];
        Expected {
            known,
            hidden,
            through,
        }
    }
}

/// Whitens residuals: each comes out with unit variance where only predicted noise is in it.
#[derive(Clone, Debug)]
pub(crate) struct Whitener {
    transform: FourierPair,
    gain: [Vec<f64>; 2],
    fillers: Vec<Arc<Filler>>,
    /// Square roots of the weights, [axis][raster]: 0 where nothing is compared.
    pub weight: Vec<Vec<f64>>,
    /// Number of values compared: accelerometer, gyroscope.
    pub count: [f64; 2],
    /// Sum of ln(predicted standard deviation) per value: accelerometer, gyroscope.
    pub log_scale: [f64; 2],
}

/// Raster entries without a usable value: (axis, from, to) with the usable entries around.
fn fill(series: &mut [f64], usable: &[bool]) {
    let mut last: Option<usize> = None;
    for k in 0..series.len() {
        if !usable[k] {
            continue;
        }
        match last {
            None => {
                let value = series[k];
                series[..k].fill(value);
            }
            Some(before) if k > before + 1 => {
                let (from, to) = (series[before], series[k]);
                for (step, value) in series[before + 1..k].iter_mut().enumerate() {
                    *value = from + (to - from) * (step + 1) as f64 / (k - before) as f64;
                }
            }
            _ => {}
        }
        last = Some(k);
    }
    match last {
        Some(before) => {
            let value = series[before];
            series[before + 1..].fill(value);
        }
        None => series.fill(0.0),
    }
}

impl Problem {
    /// What the effects' own guesses look at.
    pub fn view<'a>(&'a self, basis: &NoiseBasis, simulated: &'a [Reading]) -> ResidualView<'a> {
        ResidualView {
            stamps: &self.stamps,
            epoch: self.epoch,
            rate_hz: self.rate_hz,
            measured: &self.measured,
            simulated,
            accel_sigma: basis.sigma[0],
            gyro_sigma: basis.sigma[1],
        }
    }

    /// Residuals on the raster, by axis, with straight lines over what is not compared.
    pub fn raster(&self, of: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
        (0..6)
            .map(|axis| {
                let mut series = vec![0.0; self.length];
                let mut usable = vec![false; self.length];
                for (k, &place) in self.places.iter().enumerate() {
                    if self.usable[k][axis] {
                        series[place] = of(k, axis);
                        usable[place] = true;
                    }
                }
                fill(&mut series, &usable);
                series
            })
            .collect()
    }

    /// Measured less predicted, on the raster.
    pub fn residual(&self, predicted: &[Reading]) -> Vec<Vec<f64>> {
        self.raster(|k, axis| axis_of(&self.measured[k], axis) - axis_of(&predicted[k], axis))
    }

    fn transform_length(&self) -> usize {
        FourierPair::good_length(self.length + (2.0 * self.rate_hz) as usize)
    }

    /// The spectrum of one channel of raster series, mean over its three axes, from stretches in
    /// which all is usable.
    pub fn channel_spectrum(&self, series: &[Vec<f64>], channel: usize) -> Spectrum {
        let window = ((WINDOW_S * self.rate_hz) as usize)
            .min(self.length / 2)
            .max(16);
        let mut sum = Spectrum::default();
        for values in &series[3 * channel..3 * channel + 3] {
            let spectrum = welch(values, self.rate_hz, window);
            if sum.density.is_empty() {
                sum = Spectrum {
                    density: vec![0.0; spectrum.density.len()],
                    ..spectrum
                };
            }
            sum.density
                .iter_mut()
                .zip(&spectrum.density)
                .for_each(|(total, value)| *total += value / 3.0);
        }
        sum
    }
}

impl NoiseModel {
    /// From the declared (or found) noise per sample, the reference's error, and the residual's own
    /// spectrum above what the reference resolves.
    pub fn new(problem: &Problem, basis: &NoiseBasis, residual: &[Vec<f64>]) -> Self {
        let length = problem.transform_length();
        let spacing_hz = problem.rate_hz / length as f64;
        let spectra = [
            problem.channel_spectrum(residual, 0),
            problem.channel_spectrum(residual, 1),
        ];
        let reported = basis.estimate.spectra();
        let to_variance = problem.rate_hz / 2.0;
        let of = |channel: usize| {
            (0..=length / 2)
                .map(|k| {
                    let frequency_hz = k as f64 * spacing_hz;
                    let expected = basis.expected(frequency_hz, problem.rate_hz, &reported);
                    let (known, most) =
                        (expected.known[channel], expected.hidden[channel].max(0.0));
                    let resolved = expected.through[channel] >= RESOLVED;
                    let seen = if resolved {
                        0.0
                    } else {
                        local(&spectra[channel], frequency_hz, basis.line_hz) - known
                    };
                    let lost = seen.clamp(0.0, most);
                    (known + lost) * to_variance
                })
                .collect()
        };
        Self {
            power: [of(0), of(1)],
            spacing_hz,
        }
    }

    /// At least what a residual shows, for a refit where something unexplained is in it:
    /// frequencies that it fills say little of the effects.
    #[must_use]
    pub fn covering(&self, problem: &Problem, residual: &[Vec<f64>]) -> Self {
        let to_variance = problem.rate_hz / 2.0;
        let power = [0, 1].map(|channel| {
            let seen = problem.channel_spectrum(residual, channel);
            let level = |k: usize| local(&seen, k as f64 * self.spacing_hz, None) * to_variance;
            self.power[channel]
                .iter()
                .enumerate()
                .map(|(k, power)| power.max(level(k)))
                .collect()
        });
        Self { power, ..*self }
    }

    /// One-sided density at a frequency, (unit)^2/Hz.
    pub fn density(&self, channel: usize, frequency_hz: f64, rate_hz: f64) -> f64 {
        let index =
            ((frequency_hz / self.spacing_hz).round() as usize).min(self.power[channel].len() - 1);
        self.power[channel][index] * 2.0 / rate_hz
    }
}

/// Mean of a spectrum within its resolution of a frequency; next to a line that a vibration
/// explains, the median of its surroundings.
fn local(spectrum: &Spectrum, frequency_hz: f64, line_hz: Option<f64>) -> f64 {
    let spacing = spectrum.spacing_hz;
    if line_hz.is_some_and(|line| (line - frequency_hz).abs() < 4.0 * spacing) {
        return spectrum
            .median(frequency_hz - 12.0 * spacing, frequency_hz + 12.0 * spacing)
            .unwrap_or(0.0);
    }
    let band = spectrum.band(frequency_hz - spacing, frequency_hz + 1.6 * spacing);
    if band.is_empty() {
        spectrum.at(frequency_hz)
    } else {
        band.iter().sum::<f64>() / band.len() as f64
    }
}

impl Whitener {
    pub fn new(problem: &Problem, noise: &NoiseModel) -> Self {
        let length = problem.transform_length();
        let transform = FourierPair::new(length);
        let gain = noise.power.clone().map(|power| {
            power
                .iter()
                .map(|value| value.max(1e-30).sqrt().recip())
                .collect::<Vec<f64>>()
        });
        let log_scale = noise.power.clone().map(|power| {
            0.5 * power.iter().map(|value| value.max(1e-30).ln()).sum::<f64>() / power.len() as f64
        });
        let fillers = (0..6).map(|_| Arc::new(Filler::default())).collect();
        let mut whitener = Self {
            transform,
            gain,
            fillers,
            weight: vec![vec![0.0; problem.length]; 6],
            count: [0.0; 2],
            log_scale,
        };
        whitener.set_weights(problem, noise);
        whitener
    }

    /// Zero where nothing is compared; less next to filled entries, whose error the whitening
    /// spreads: `1 / (1 + sum h^2 v)`, with h the whitening's impulse response and v the expected
    /// squared error of what is filled in.
    fn set_weights(&mut self, problem: &Problem, noise: &NoiseModel) {
        let length = self.transform.length();
        for channel in 0..2 {
            let covariance = self.covariance(&noise.power[channel]);
            let mut response: Vec<Complex64> = (0..length)
                .map(|k| Complex64::new(self.gain[channel][k.min(length - k)], 0.0))
                .collect();
            self.transform.inverse(&mut response);
            response
                .iter_mut()
                .for_each(|value| *value = Complex64::new(value.re * value.re, 0.0));
            self.transform.forward(&mut response);
            let mut known: Option<Vec<bool>> = None;
            for axis in 3 * channel..3 * channel + 3 {
                let mut there = vec![false; length];
                problem
                    .places
                    .iter()
                    .enumerate()
                    .for_each(|(k, &place)| there[place] = problem.usable[k][axis]);
                if known.as_ref() == Some(&there) {
                    self.fillers[axis] = self.fillers[axis - 1].clone();
                    self.weight[axis] = self.weight[axis - 1].clone();
                } else {
                    let filler = Filler::new(&there, &covariance);
                    let mut missing: Vec<Complex64> = filler
                        .variance
                        .iter()
                        .map(|variance| Complex64::new(*variance, 0.0))
                        .collect();
                    self.transform.forward(&mut missing);
                    missing
                        .iter_mut()
                        .zip(&response)
                        .for_each(|(value, factor)| *value *= *factor);
                    self.transform.inverse(&mut missing);
                    for k in 0..problem.length {
                        self.weight[axis][k] = if there[k] {
                            (1.0 / (1.0 + missing[k].re.max(0.0))).sqrt()
                        } else {
                            0.0
                        };
                    }
                    self.fillers[axis] = Arc::new(filler);
                    known = Some(there);
                }
                self.count[channel] += self.weight[axis]
                    .iter()
                    .map(|weight| weight * weight)
                    .sum::<f64>();
            }
        }
    }

    /// Autocovariance of the predicted noise.
    fn covariance(&self, power: &[f64]) -> Vec<f64> {
        let length = self.transform.length();
        let mut values: Vec<Complex64> = (0..length)
            .map(|k| Complex64::new(power[k.min(length - k)], 0.0))
            .collect();
        self.transform.inverse(&mut values);
        values.iter().map(|value| value.re).collect()
    }

    /// Six raster series in units of the predicted noise, one behind the other, times the square
    /// root of their weights.
    pub fn apply(&self, series: &[Vec<f64>]) -> Vec<f64> {
        let count = series[0].len();
        let length = self.transform.length();
        let extended: Vec<Vec<f64>> = (0..6)
            .map(|axis| {
                let mut values = series[axis].clone();
                values.resize(length, 0.0);
                self.fillers[axis].fill(&mut values);
                values
            })
            .collect();
        let mut flat = vec![0.0; 6 * count];
        let mut buffer = vec![Complex64::default(); length];
        // Two axes of a channel at once; the last axes of both share one transform.
        for (first, second) in [(0, 1), (3, 4), (2, 5)] {
            for (slot, (a, b)) in buffer
                .iter_mut()
                .zip(extended[first].iter().zip(&extended[second]))
            {
                *slot = Complex64::new(*a, *b);
            }
            self.transform.forward(&mut buffer);
            let (of_a, of_b) = (&self.gain[first / 3], &self.gain[second / 3]);
            if first / 3 == second / 3 {
                for (k, value) in buffer.iter_mut().enumerate() {
                    *value *= of_a[k.min(length - k)];
                }
            } else {
                for k in 0..=length / 2 {
                    let mirror = (length - k) % length;
                    let (here, there) = (buffer[k], buffer[mirror].conj());
                    let (even, odd) = ((here + there) * 0.5, (here - there) * 0.5);
                    let (even, odd) = (even * of_a[k], odd * of_b[k]);
                    buffer[k] = even + odd;
                    buffer[mirror] = (even - odd).conj();
                }
            }
            self.transform.inverse(&mut buffer);
            for k in 0..count {
                flat[first * count + k] = buffer[k].re * self.weight[first][k];
                flat[second * count + k] = buffer[k].im * self.weight[second][k];
            }
        }
        flat
    }
}
