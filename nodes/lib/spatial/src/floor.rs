//! What is noise and what is motion in a spectrum of poses.

use crate::segments::{Filter, HOP_S, centres};
use crate::spectrum::interpolated;
use crate::{Spectrum, welch};

/// Length of the windows from which the spectra are learnt, s, and below which multiple of the
/// noise a spectrum counts as noise alone: three standard errors over three axes of a minute. The
/// longer ones resolve lines, which steady gaits and machines have.
const WINDOWS: [(f64, f64); 3] = [(5.0, 1.4), (20.0, 3.0), (f64::INFINITY, 8.0)];
/// Multiple of the noise at which a window's band of motion ends.
const LOCAL_EDGE: f64 = 2.2;
/// The same beyond the band of motion, where among hundreds of frequencies some reach three
/// standard errors by chance, and where the second derivative makes much of little.
const LONE_BAND: f64 = 2.2;
/// Slowest plateau that may be noise, Hz.
const LEAST_PLATEAU_HZ: f64 = 12.0;
/// A third of an octave, about.
const THIRD: f64 = 1.3;
/// What of the density a third of an octave leaves of motion at most: f^-3.3; where a clear knee
/// lies before it f^-5.3.
const SLOW: f64 = 0.42;
const SLOW_AFTER_KNEE: f64 = 0.25;
/// Fall from the middle of the band to its top, as a factor, up to which the top counts as level.
const LEVEL_TOP: f64 = 1.35;
/// Largest rise of a wandering noise below its knee, as a power of the frequency: of positions, of
/// rotations. Where poses were compared with IMUs (11 optical recordings), these served better than
/// a random walk's 2.
pub(crate) const LARGEST_RISE: [f64; 2] = [1.0, 0.0];
/// How motion is taken to fall beyond its band, as a power of the frequency.
const MOTION_FALL: f64 = 8.0;
/// How far around a line the filter stays open, Hz: a line's amplitude changes over some seconds.
const LINE_HZ: f64 = 0.1;
/// Largest factor by which a smoothing that is undone may amplify: its true shape is nowhere
/// written, and errors grow with it.
pub(crate) const LARGEST_GAIN: f64 = 8.0;
/// And what is still said of the gain that it would take.
pub(crate) const LARGEST_LOSS: f64 = 1000.0;

/// What is noise in a spectrum.
#[derive(Clone, Debug)]
pub(crate) struct Floor {
    /// Mean spectra with short to long windows, and from which multiple of the noise on they show
    /// motion.
    pub spectra: Vec<(Spectrum, f64)>,
    /// One-sided density of the white floor of the poses as they are, mean over the coordinates.
    pub white: f64,
    /// Whether the noise wanders: then no level plateau shows where motion ends, and its fall goes
    /// on beneath the noise.
    wandering: bool,
    largest_rise: f64,
    /// Density of the noise after a smoothing is undone.
    pub noise: Vec<f64>,
    /// Wiener's filter, finer than the spectrum; its mean over the windows once these are known.
    pub filter: Vec<f64>,
    /// The filter of each window.
    pub windows: Vec<Filter>,
    /// Distance of the frequencies of filter and noise, Hz.
    pub spacing_hz: f64,
}

/// Gain that undoes a zero-phase second-order Butterworth smoothing, `1 / (1 + (f / fc)^4)`, with
/// the frequencies as the bilinear transform bends them at the poses' rate.
pub(crate) fn undo(frequency_hz: f64, undone_hz: Option<f64>, rate_hz: f64) -> f64 {
    undone_hz.map_or(1.0, |cutoff_hz| {
        let bent = |hz: f64| (std::f64::consts::PI * (hz / rate_hz).min(0.499)).tan();
        1.0 + (bent(frequency_hz) / bent(cutoff_hz)).powi(4)
    })
}

impl Floor {
    pub fn learn(coordinates: &[Vec<f64>], rate_hz: f64, largest_rise: f64) -> Self {
        let count = coordinates[0].len();
        let spectra: Vec<(Spectrum, f64)> = WINDOWS
            .iter()
            .map(|&(seconds, alone)| {
                let window = if seconds.is_finite() {
                    (seconds * rate_hz) as usize
                } else {
                    count - 1
                };
                let most = if seconds > 5.0 { count - 1 } else { count / 4 };
                (
                    mean_spectrum(coordinates, rate_hz, window.min(most).max(8)),
                    alone,
                )
            })
            .collect();
        Self::from_spectra(spectra, rate_hz, None, largest_rise)
    }

    /// The floor after a smoothing of the poses is undone. The noise is what was added after the
    /// smoothing, amplified, or what was there before, a plateau of the undone spectrum; whichever
    /// is more.
    pub fn undoing(&self, cutoff_hz: f64, rate_hz: f64) -> Self {
        Self::from_spectra(
            self.spectra.clone(),
            rate_hz,
            Some(cutoff_hz),
            self.largest_rise,
        )
    }

    fn from_spectra(
        spectra: Vec<(Spectrum, f64)>,
        rate_hz: f64,
        undone_hz: Option<f64>,
        largest_rise: f64,
    ) -> Self {
        let spectrum = &spectra[0].0;
        let gain2 = |frequency_hz: f64| undo(frequency_hz, undone_hz, rate_hz).powi(2);
        let shape = NoiseShape::learn(spectrum, rate_hz, largest_rise);
        let floor = shape.level;
        // Where the undone spectrum is least, beyond the slowest motion, lies the noise that was
        // there before.
        let usable = (3..spectrum.density.len())
            .map(|k| (spectrum.frequency(k), spectrum.density[k]))
            .filter(|(hz, _)| gain2(*hz) <= LARGEST_GAIN.powi(2));
        let before = undone_hz.map_or(0.0, |_| {
            usable
                .map(|(hz, density)| density * gain2(hz))
                .fold(f64::INFINITY, f64::min)
        });
        let before = if before.is_finite() { before } else { 0.0 };
        let noise_at =
            |frequency_hz: f64| (shape.at(frequency_hz) * gain2(frequency_hz)).max(before);
        let spacing_hz = spectra[2].0.spacing_hz.min(spectrum.spacing_hz);
        let edge_hz = edge(spectrum, &|hz| noise_at(hz) / gain2(hz));
        let bins = (rate_hz / 2.0 / spacing_hz) as usize + 1;
        let weight = |frequency_hz: f64, (spectrum, alone): &(Spectrum, f64)| {
            let density = spectrum.at(frequency_hz) * gain2(frequency_hz);
            let noise = noise_at(frequency_hz);
            let alone = if frequency_hz < edge_hz {
                *alone
            } else {
                alone.max(LONE_BAND)
            };
            if density <= alone * noise
                || density <= 0.0
                || gain2(frequency_hz) > LARGEST_GAIN.powi(2)
            {
                0.0
            } else {
                1.0 - noise / density
            }
        };
        let of = |which: usize| {
            (0..bins)
                .map(|k| weight(k as f64 * spacing_hz, &spectra[which]))
                .collect::<Vec<f64>>()
        };
        let lines: Vec<f64> = of(1).iter().zip(of(2)).map(|(a, b)| a.max(b)).collect();
        let reach = (LINE_HZ / spacing_hz).round() as usize;
        let mut filter: Vec<f64> = of(0);
        for (k, value) in filter.iter_mut().enumerate() {
            let around = &lines[k.saturating_sub(reach)..(k + reach + 1).min(bins)];
            *value = around.iter().copied().fold(*value, f64::max);
        }
        // Sharp edges ring for long.
        let mut filter = running_mean(&running_mean(&filter, reach), reach);
        for (k, value) in filter.iter_mut().enumerate() {
            // The mean and what is slower than a window is motion.
            if (k as f64) * spacing_hz < 1.5 * spectra[0].0.spacing_hz {
                *value = 1.0;
            }
        }
        let noise = (0..bins)
            .map(|k| {
                noise_at(k as f64 * spacing_hz)
                    .min(shape.at(k as f64 * spacing_hz).max(before) * LARGEST_GAIN.powi(2))
            })
            .collect();
        Self {
            white: floor,
            spectra,
            wandering: shape.above > 0.0,
            largest_rise,
            noise,
            filter,
            windows: Vec::new(),
            spacing_hz,
        }
    }

    /// A filter for each window from its own spectrum; motion comes in bursts, and rests let noise
    /// through that the mean motion would hide. The band ends where three neighbours lie near the
    /// noise; within it, lines that the long windows resolve keep their full height.
    pub fn localise(&mut self, local: &[Spectrum], rate_hz: f64, undone_hz: Option<f64>) {
        let gain2 = |hz: f64| undo(hz, undone_hz, rate_hz).powi(2);
        let mut mean = vec![0.0; self.filter.len()];
        self.windows = local
            .iter()
            .map(|spectrum| {
                let ratio: Vec<f64> = spectrum
                    .density
                    .iter()
                    .enumerate()
                    .map(|(k, density)| {
                        let hz = spectrum.frequency(k);
                        density * gain2(hz) / self.noise_at(hz).max(1e-300)
                    })
                    .collect();
                let bins = ratio.len();
                let edge = (2..bins.saturating_sub(3))
                    .find(|&k| ratio[k..k + 3].iter().all(|value| *value < LOCAL_EDGE))
                    .unwrap_or(bins);
                let edge_hz = spectrum.frequency(edge);
                // Above what the noise is, at the last three frequencies of the band.
                let last = (1..=3)
                    .filter_map(|back| ratio.get(edge.checked_sub(back)?))
                    .sum::<f64>()
                    / 3.0
                    - 1.0;
                let beyond = |hz: f64| {
                    let motion =
                        last.max(0.0) * self.noise_at(edge_hz) * (edge_hz / hz).powf(MOTION_FALL);
                    motion / (motion + self.noise_at(hz)).max(1e-300)
                };
                let weights: Vec<f64> = (0..bins)
                    .map(|k| {
                        let hz = spectrum.frequency(k);
                        if k < 2 {
                            1.0
                        } else if k >= edge && self.wandering && undone_hz.is_none() {
                            beyond(hz)
                        } else if k >= edge || ratio[k] <= 1.0 || gain2(hz) > LARGEST_GAIN.powi(2) {
                            0.0
                        } else {
                            let own = 1.0 - 1.0 / ratio[k];
                            if ratio[k] > LOCAL_EDGE {
                                own.max(self.filter_at(hz))
                            } else {
                                own
                            }
                        }
                    })
                    .collect();
                let filter = Filter {
                    spacing_hz: spectrum.spacing_hz,
                    weights,
                };
                for (k, sum) in mean.iter_mut().enumerate() {
                    *sum += filter.at(k as f64 * self.spacing_hz) / local.len() as f64;
                }
                filter
            })
            .collect();
        self.filter = mean;
    }

    pub fn filter_at(&self, frequency_hz: f64) -> f64 {
        interpolated(&self.filter, frequency_hz / self.spacing_hz)
    }

    pub fn noise_at(&self, frequency_hz: f64) -> f64 {
        interpolated(&self.noise, frequency_hz / self.spacing_hz)
    }

    pub fn spectrum(&self) -> &Spectrum {
        &self.spectra[0].0
    }
}

/// Mean over `reach` entries on either side.
fn running_mean(values: &[f64], reach: usize) -> Vec<f64> {
    let mut sums = vec![0.0; values.len() + 1];
    for (k, value) in values.iter().enumerate() {
        sums[k + 1] = sums[k] + value;
    }
    (0..values.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(values.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

/// Spectra around the centres of the windows, smoothed over five neighbours.
pub(crate) fn local_spectra(coordinates: &[Vec<f64>], rate_hz: f64) -> Vec<Spectrum> {
    let count = coordinates[0].len();
    let length = ((2.0 * HOP_S * rate_hz) as usize).min(count);
    centres(count, rate_hz)
        .into_iter()
        .map(|centre| {
            let from = centre.saturating_sub(length / 2).min(count - length);
            let parts: Vec<Vec<f64>> = coordinates
                .iter()
                .map(|series| series[from..from + length].to_vec())
                .collect();
            let spectrum = mean_spectrum(&parts, rate_hz, length - 1);
            let density = (0..spectrum.density.len())
                .map(|k| {
                    let near = |step: usize| {
                        0.5 * (spectrum.density[k.saturating_sub(step)]
                            + spectrum.density[(k + step).min(spectrum.density.len() - 1)])
                    };
                    // Not where the spectrum is steep: its slope would spill into the noise.
                    let smooth = (spectrum.density[k] * 3.0 + near(1) * 4.0 + near(2) * 2.0) / 9.0;
                    smooth
                        .min(4.0 * spectrum.density[k].max(near(1).min(spectrum.density[k] * 4.0)))
                })
                .collect();
            Spectrum {
                density,
                ..spectrum
            }
        })
        .collect()
}

/// Where the band of motion ends: from there on three neighbours lie at the noise.
fn edge(spectrum: &Spectrum, noise_at: &dyn Fn(f64) -> f64) -> f64 {
    let quiet = |k: usize| spectrum.density[k] < WINDOWS[0].1 * noise_at(spectrum.frequency(k));
    let last = spectrum.density.len().saturating_sub(2);
    let first = (0..last)
        .find(|&k| quiet(k) && quiet(k + 1) && quiet(k + 2))
        .unwrap_or(spectrum.density.len());
    spectrum.frequency(first)
}

/// Mean Welch spectrum of several coordinates.
fn mean_spectrum(coordinates: &[Vec<f64>], rate_hz: f64, window: usize) -> Spectrum {
    let mut mean = Spectrum::default();
    for series in coordinates {
        // Differences first: a steep spectrum would leak through the window. Undone by |2 sin(pi f
        // / rate)|^2.
        let differences: Vec<f64> = series.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let spectrum = welch(&differences, rate_hz, window);
        if mean.density.is_empty() {
            mean = Spectrum {
                density: vec![0.0; spectrum.density.len()],
                ..spectrum
            };
        }
        for (k, sum) in mean.density.iter_mut().enumerate() {
            let gain = 2.0
                * (std::f64::consts::PI * k.max(1) as f64 * spectrum.spacing_hz / rate_hz).sin();
            *sum += spectrum.density[k] / (gain * gain * coordinates.len() as f64);
        }
    }
    mean
}

/// Density of the noise over the frequency: level, or a power law around a knee.
///
/// White noise shows as a level top of the spectrum. Where the top falls, the poses were resampled
/// from fewer frames, filtered, or come from a tracker whose errors wander: then noise begins at
/// the knee where the spectrum first falls slower than motion does (displacement of bodies falls
/// with the fourth power of the frequency and more; f^-3.3 is the border here), and rises a little
/// below the knee.
#[derive(Clone, Copy, Debug)]
struct NoiseShape {
    /// Density at the knee, or everywhere.
    level: f64,
    knee_hz: f64,
    /// Negative exponents below and above the knee.
    below: f64,
    above: f64,
}

impl NoiseShape {
    fn learn(spectrum: &Spectrum, rate_hz: f64, largest_rise: f64) -> Self {
        let nyquist_hz = rate_hz / 2.0;
        let level = |from_hz: f64, to_hz: f64| spectrum.median(from_hz, to_hz).unwrap_or(0.0);
        let top = level(0.70 * nyquist_hz, 0.97 * nyquist_hz);
        let white = Self {
            level: top,
            knee_hz: nyquist_hz,
            below: 0.0,
            above: 0.0,
        };
        // Lines (of the frames that were resampled) lift parts of the top.
        let parts = [(0.6, 0.7), (0.7, 0.8), (0.8, 0.9), (0.9, 0.97)]
            .map(|(a, b)| level(a * nyquist_hz, b * nyquist_hz));
        let least = parts.into_iter().fold(f64::INFINITY, f64::min);
        if level(0.45 * nyquist_hz, 0.6 * nyquist_hz) < LEVEL_TOP * least {
            return white;
        }
        let mut from_hz = LEAST_PLATEAU_HZ;
        while from_hz * THIRD.powi(3) < 0.9 * nyquist_hz {
            let thirds = [-2, -1, 0, 1, 2]
                .map(|k| level(THIRD.powi(k) * from_hz, THIRD.powi(k + 1) * from_hz));
            let ratios = [
                thirds[1] / thirds[0],
                thirds[3] / thirds[2],
                thirds[4] / thirds[3],
            ];
            let slow = ratios[1..].iter().all(|&ratio| {
                ratio < 1.7 && (ratio > SLOW || ratio > SLOW_AFTER_KNEE && ratios[0] < 0.45 * ratio)
            });
            if slow && thirds[2] > 4.0 * least {
                let above = ((thirds[2] / thirds[4]).ln() / THIRD.powi(2).ln()).max(0.0);
                // At the knee itself some motion is left.
                let level = thirds[2].min(thirds[3] * THIRD.powf(above));
                return Self {
                    level,
                    knee_hz: THIRD.sqrt() * from_hz,
                    below: above.min(largest_rise),
                    above,
                };
            }
            from_hz *= 1.05;
        }
        white
    }

    fn at(&self, frequency_hz: f64) -> f64 {
        let ratio = self.knee_hz / frequency_hz.max(0.1);
        self.level * ratio.powf(if ratio > 1.0 { self.below } else { self.above })
    }
}
