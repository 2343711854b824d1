//! The noise that a residual should have.

use std::f64::consts::TAU;
use std::sync::Arc;

use cromosim_imu::{Channel, PerChannel, STANDARD_GRAVITY};
use cromosim_spatial::{FourierPair, PoseEstimate, Spectrum, ZeroPhaseSmoothing};

use crate::prepared::PreparedPlacement;

/// Share of the motion from which on a frequency counts as resolved by the reference.
const RESOLVED: f64 = 0.9;
/// Motion beyond this is none that a reference could have lost, Hz: blows of a tool reach it, and the noise of
/// acceleration there would cover whatever is unknown. No source.
const FASTEST_LOST_HZ: f64 = 30.0;
/// Power of the frequency with which displacements fall at least beyond the poses' Nyquist frequency: their acceleration
/// falls with the square. No source for the number.
const LEAST_FALL: f64 = 6.0;
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
/// band that the reference resolves; it is never taken for larger than that noise allows. What the reference's error
/// has beyond half of the IMU's rate folds over, and so does what is lost up to [`FASTEST_LOST_HZ`].
#[derive(Clone, Debug)]
pub(crate) struct NoiseModel {
    /// Two-sided per-sample variance spectra (density times rate / 2) at the transform's
    /// frequencies.
    pub power: PerChannel<Vec<f64>>,
    pub spacing_hz: f64,
}

/// What the noise of a residual is predicted from.
#[derive(Clone, Debug)]
pub(crate) struct NoiseBasis {
    /// White noise per sample.
    pub sigma: PerChannel<f64>,
    /// Length of the lever arm, m.
    pub lever_arm_m: f64,
    /// Of the reference's motion.
    pub estimate: Arc<PoseEstimate>,
    /// The reference's smoothing that the estimate undoes.
    pub undone_smoothing: Option<ZeroPhaseSmoothing>,
    /// Mean square of the angular velocity, rad2/s2.
    pub rate_squared: f64,
    /// Mean square of the specific force, m2/s4.
    pub force_squared: f64,
    /// A line that may be a vibration.
    pub line_hz: Option<f64>,
    /// Steps of quantisation in units of the white noise: rounding errors of slow motion are no
    /// white noise.
    pub steps: PerChannel<f64>,
    pub reference_share: ReferenceShare,
}

/// Shares of the reference's noise densities that count as the residual's own noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReferenceShare {
    pub position: f64,
    pub rotation: f64,
}

impl NoiseBasis {
    /// Without lever arm, motion and line; all of the reference's noise counts.
    pub fn new(estimate: PoseEstimate, sigma: PerChannel<f64>) -> Self {
        Self {
            sigma,
            lever_arm_m: 0.0,
            estimate: Arc::new(estimate),
            undone_smoothing: None,
            rate_squared: 0.0,
            force_squared: STANDARD_GRAVITY.powi(2),
            line_hz: None,
            steps: PerChannel::default(),
            reference_share: ReferenceShare {
                position: 1.0,
                rotation: 1.0,
            },
        }
    }
}

/// The reference's error in a band of a channel.
pub(crate) struct ReferenceError {
    /// Per sample, were it as dense in all bands.
    pub variance: f64,
    /// Most that motion can leave which the estimate does not keep, with what folds over.
    pub of_lost_motion: f64,
    /// Whether the estimate keeps the motion there.
    pub is_resolved: bool,
}

/// One-sided densities at a frequency, by channel.
struct Expected {
    /// The error of the estimate, and the sensor's noise once it is added.
    known: PerChannel<f64>,
    /// Most that motion which the estimate leaves out can be.
    hidden: PerChannel<f64>,
    /// Share of the motion that the estimate keeps.
    through: PerChannel<f64>,
}

impl Expected {
    /// Nothing is hidden where the reference resolves the motion.
    fn keep_unresolved(&mut self) {
        for channel in Channel::ALL {
            let hidden = &mut self.hidden[channel];
            *hidden = if self.through[channel] >= RESOLVED {
                0.0
            } else {
                hidden.max(0.0)
            };
        }
    }
}

impl NoiseBasis {
    /// The densities that [`NoiseModel`] states, with what folds over from beyond half of the IMU's rate.
    fn expected_folded(
        &self,
        frequency_hz: f64,
        rate_hz: f64,
        reported: &(Spectrum, Spectrum),
    ) -> Expected {
        let mut sum = self.expected(frequency_hz, reported);
        sum.keep_unresolved();
        let white = |channel: Channel| 2.0 * self.sigma[channel] * self.sigma[channel] / rate_hz;
        let nyquist_hz = self.estimate.rate_hz() / 2.0;
        let folded = (1..).flat_map(|turn| {
            let turned_hz = f64::from(turn) * rate_hz;
            [turned_hz - frequency_hz, turned_hz + frequency_hz]
        });
        for hz in folded.take_while(|hz| *hz < nyquist_hz) {
            let mut beyond = self.expected(hz, reported);
            beyond.keep_unresolved();
            for channel in Channel::ALL {
                sum.known[channel] += beyond.known[channel];
                if hz < FASTEST_LOST_HZ {
                    sum.hidden[channel] += beyond.hidden[channel];
                }
            }
        }
        for channel in Channel::ALL {
            sum.known[channel] += white(channel);
        }
        sum
    }

    /// Variance per sample that the reference's error leaves in a channel at least, in the bands (parts of half of the IMU's
    /// rate) that show a sensor's white noise: nothing where the estimate's filter ends below them.
    pub fn least_reference_error(
        &self,
        prepared: &PreparedPlacement,
        channel: Channel,
        bands: &[(f64, f64)],
    ) -> f64 {
        let errors = self.reference_errors(prepared, channel, bands);
        let least = errors
            .map(|error| error.variance)
            .fold(f64::INFINITY, f64::min);
        least.max(0.0)
    }

    /// What the reference's error leaves in the middles of bands (parts of half of the IMU's rate).
    pub fn reference_errors(
        &self,
        prepared: &PreparedPlacement,
        channel: Channel,
        bands: &[(f64, f64)],
    ) -> impl Iterator<Item = ReferenceError> {
        let nyquist_hz = prepared.rate_hz / 2.0;
        let reported = self.estimate.spectra();
        let white = self.sigma[channel] * self.sigma[channel];
        bands.iter().map(move |(from, to)| {
            let middle_hz = 0.5 * (from + to) * nyquist_hz;
            let expected = self.expected_folded(middle_hz, prepared.rate_hz, &reported);
            ReferenceError {
                variance: expected.known[channel] * nyquist_hz - white,
                of_lost_motion: expected.hidden[channel] * nyquist_hz,
                is_resolved: expected.through[channel] >= RESOLVED,
            }
        })
    }

    /// The densities of the reference's error, before what is lost is added.
    fn expected(&self, frequency_hz: f64, (position, rotation): &(Spectrum, Spectrum)) -> Expected {
        let squared = (TAU * frequency_hz).powi(2);
        let (error_p, error_r) = self.estimate.error_density(frequency_hz);
        let (error_p, error_r) = (
            error_p * self.reference_share.position,
            error_r * self.reference_share.rotation,
        );
        let (through_p, through_r, gain) = self.estimate.filter_at(frequency_hz);
        let (lever2, w2, f2) = (
            self.lever_arm_m * self.lever_arm_m,
            self.rate_squared,
            self.force_squared,
        );
        let lever = 2.0 / 3.0 * lever2 * (squared * squared + 3.0 * squared * w2 + w2 * w2);
        let known = PerChannel {
            accelerometer: squared * squared * error_p + (2.0 / 3.0 * f2 + lever) * error_r,
            gyroscope: (squared + 2.0 / 3.0 * w2) * error_r,
        };
        // Motion below the reference's noise: at most that noise itself.
        let of_motion = gain * gain * fall_beyond(self.estimate.rate_hz() / 2.0, frequency_hz);
        let hidden_p =
            squared * squared * position.at(frequency_hz) * (1.0 - through_p) * of_motion;
        let hidden_r = squared * rotation.at(frequency_hz) * (1.0 - through_r) * of_motion;
        let hidden = PerChannel {
            accelerometer: hidden_p + 2.0 / 3.0 * lever2 * squared * hidden_r,
            gyroscope: hidden_r,
        };
        let through = PerChannel {
            accelerometer: if lever2 > 0.0 {
                through_p.min(through_r)
            } else {
                through_p
            },
            gyroscope: through_r,
        };
        Expected {
            known,
            hidden,
            through,
        }
    }
}

/// How much less dense motion is at a frequency than where the poses' spectrum ends.
fn fall_beyond(nyquist_hz: f64, frequency_hz: f64) -> f64 {
    (nyquist_hz / frequency_hz.max(nyquist_hz)).powf(LEAST_FALL)
}

impl NoiseModel {
    /// From the declared (or found) noise per sample, the reference's error, and the residual's own
    /// spectrum above what the reference resolves.
    pub fn new(prepared: &PreparedPlacement, basis: &NoiseBasis, residual: &[Vec<f64>]) -> Self {
        let length = transform_length(prepared);
        let spacing_hz = prepared.rate_hz / length as f64;
        let reported = basis.estimate.spectra();
        let to_variance = prepared.rate_hz / 2.0;
        let power = PerChannel::from_fn(|channel| {
            let spectrum = prepared.channel_spectrum(residual, channel);
            (0..=length / 2)
                .map(|k| {
                    let frequency_hz = k as f64 * spacing_hz;
                    let expected = basis.expected_folded(frequency_hz, prepared.rate_hz, &reported);
                    let (known, most) = (expected.known[channel], expected.hidden[channel]);
                    let seen = if most > 0.0 {
                        local(&spectrum, frequency_hz, basis.line_hz) - known
                    } else {
                        0.0
                    };
                    let lost = seen.clamp(0.0, most);
                    (known + lost) * to_variance
                })
                .collect()
        });
        Self { power, spacing_hz }
    }

    /// At least what a residual shows, for a refit where something unexplained is in it:
    /// frequencies that it fills say little of the effects.
    #[must_use]
    pub fn covering(&self, prepared: &PreparedPlacement, residual: &[Vec<f64>]) -> Self {
        let to_variance = prepared.rate_hz / 2.0;
        let power = PerChannel::from_fn(|channel| {
            let seen = prepared.channel_spectrum(residual, channel);
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
    pub fn density(&self, channel: Channel, frequency_hz: f64, rate_hz: f64) -> f64 {
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

/// Length of the Fourier transforms of a placement's series: two seconds of padding, so that its
/// ends do not touch.
pub(crate) fn transform_length(prepared: &PreparedPlacement) -> usize {
    FourierPair::good_length(prepared.length + (2.0 * prepared.rate_hz) as usize)
}
