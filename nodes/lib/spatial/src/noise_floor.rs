//! What is noise and what is motion in a spectrum of poses.

use crate::beyond_band::{leave_out_machine, motion_beyond, steady_machines};
use crate::local_noise::local_noise;
use crate::noise_shape::NoiseShape;
use crate::pose_spectra::mean_spectrum;
use crate::segments::Filter;
use crate::spectrum::interpolated;
use crate::zero_phase_smoothing::undoing_gain;
use crate::{Spectrum, ZeroPhaseSmoothing};

/// Largest rise of a wandering noise below its knee, as a power of the frequency: of positions, of
/// rotations. Chosen on the eleven optical recordings with IMUs that the diagnosis reports on, where
/// these served better than a random walk's 2.
pub(crate) const LARGEST_RISE: [f64; 2] = [1.0, 0.0];
/// How motion is taken to fall beyond its band, as a power of the frequency. Chosen on the same
/// recordings.
const MOTION_FALL: f64 = 8.0;
/// Seconds of the windows from which the spectra are learnt. The longer ones resolve lines, which
/// steady gaits and machines have; the longest is the whole series. No source.
const WINDOWS_S: [f64; 3] = [5.0, 20.0, f64::INFINITY];
/// Least number of windows of the shortest length: a short series has shorter windows.
const LEAST_SHORT_WINDOWS: usize = 4;
/// Fewest samples of a window.
const LEAST_WINDOW: usize = 8;
/// Multiple of the noise below which the spectrum of each length of window counts as noise alone. Of
/// the shortest: three standard errors over three axes of a minute; of the others: no
/// source.
const NOISE_ALONE: [f64; 3] = [1.4, 3.0, 8.0];
/// The least such multiple beyond the band of motion, where among hundreds of frequencies some reach
/// three standard errors by chance, and where the second derivative makes much of little. No source
/// for the number.
const NOISE_ALONE_BEYOND_BAND: f64 = 2.2;
/// Multiple of the noise at which a window's own band of motion ends; no source.
const LOCAL_EDGE: f64 = 2.2;
/// How far around a spectral line the filter stays open, Hz: a line's amplitude changes over some
/// seconds. No source for the number.
const LINE_REACH_HZ: f64 = 0.1;
/// Entries at the start of a spectrum that are motion, whatever their density: slower than a window.
const SLOWER_THAN_WINDOW: f64 = 1.5;
/// The same entries and one more, which are not looked at for the noise before a smoothing.
const SLOWEST_ENTRIES: usize = 3;
/// Largest factor by which a smoothing that is undone may amplify: its true shape is nowhere
/// written, and errors grow with it. Chosen between 8 and 32 on 18 smoothed recordings of the withheld
/// generator (seed 22): up to here a Gaussian's gain and Butterworth's differ by
/// less than a factor of two.
pub(crate) const LARGEST_GAIN: f64 = 32.0;
/// Largest gain that is still reported where more would be needed. No source.
pub(crate) const LARGEST_REPORTED_GAIN: f64 = 1000.0;
/// What of a neighbouring window's motion may ring in a window whose filter keeps it out, as a power: a filter
/// that ends sharply at B rings as sin(2 pi B t) / (pi t), and is 1 / (pi B t) of its height t later; a tenth
/// of the power at a second and a hertz.
const RINGING: f64 = 0.1;
/// Windows on either side that a window's stretch reaches into.
const RINGING_REACH: usize = 2;
/// Stands for a density of nothing in divisions.
const TINY: f64 = 1e-300;

/// A spectrum from windows of one length.
#[derive(Clone, Debug)]
struct LearntSpectrum {
    spectrum: Spectrum,
    /// From which multiple of the noise on it shows motion.
    noise_alone: f64,
}

/// The noise in the coordinates of poses, and the filter that keeps it out.
#[derive(Clone, Debug)]
pub(crate) struct NoiseFloor {
    /// Mean spectra with short to long windows.
    spectra: [LearntSpectrum; 3],
    /// Of the noise of the poses as they are, mean over the coordinates.
    pub shape: NoiseShape,
    largest_rise: f64,
    /// Density of the noise after a smoothing is undone.
    noise: Vec<f64>,
    /// Wiener's filter, finer than the spectrum; its mean over the windows once these are known.
    pub filter: Vec<f64>,
    /// The filter of each window.
    pub windows: Vec<Filter>,
    /// Distance of the frequencies of filter and noise, Hz.
    pub spacing_hz: f64,
}

impl NoiseFloor {
    /// Learns from the coordinates of poses at `rate_hz`, all of one unit and length.
    pub fn learn(coordinates: &[Vec<f64>], rate_hz: f64, largest_rise: f64) -> Self {
        let count = coordinates[0].len();
        let spectra = std::array::from_fn(|which| {
            let seconds = WINDOWS_S[which];
            let window = if seconds.is_finite() {
                (seconds * rate_hz) as usize
            } else {
                count - 1
            };
            let most = if which > 0 {
                count - 1
            } else {
                count / LEAST_SHORT_WINDOWS
            };
            LearntSpectrum {
                spectrum: mean_spectrum(coordinates, rate_hz, window.min(most).max(LEAST_WINDOW)),
                noise_alone: NOISE_ALONE[which],
            }
        });
        Self::from_spectra(spectra, rate_hz, None, largest_rise)
    }

    /// The floor anew, where a smoothing of the poses is undone. The noise is what was added after the
    /// smoothing, amplified, or what was there before, a plateau of the undone spectrum; whichever
    /// is more.
    pub fn undoing(&self, undone: Option<ZeroPhaseSmoothing>, rate_hz: f64) -> Self {
        Self::from_spectra(self.spectra.clone(), rate_hz, undone, self.largest_rise)
    }

    fn from_spectra(
        spectra: [LearntSpectrum; 3],
        rate_hz: f64,
        undone: Option<ZeroPhaseSmoothing>,
        largest_rise: f64,
    ) -> Self {
        let spectrum = &spectra[0].spectrum;
        let gain2 = |frequency_hz: f64| undoing_gain(frequency_hz, undone, rate_hz).powi(2);
        let shape = NoiseShape::learn(spectrum, rate_hz, largest_rise);
        let before = match undone {
            Some(_) => noise_before_smoothing(spectrum, &gain2, &shape),
            None => 0.0,
        };
        let noise_at =
            |frequency_hz: f64| (shape.at(frequency_hz) * gain2(frequency_hz)).max(before);
        let spacing_hz = spectra[2].spectrum.spacing_hz.min(spectrum.spacing_hz);
        let bins = (rate_hz / 2.0 / spacing_hz) as usize + 1;
        let wiener = Wiener {
            gain2: &gain2,
            noise_at: &noise_at,
            edge_hz: band_edge_hz(spectrum, &|hz| noise_at(hz) / gain2(hz)),
        };
        let filter = mean_filter(&spectra, &wiener, spacing_hz, bins);
        let noise = (0..bins)
            .map(|k| {
                noise_at(k as f64 * spacing_hz)
                    .min(shape.at(k as f64 * spacing_hz).max(before) * LARGEST_GAIN.powi(2))
            })
            .collect();
        Self {
            shape,
            spectra,
            largest_rise,
            noise,
            filter,
            windows: Vec::new(),
            spacing_hz,
        }
    }

    /// A filter for each window from its own spectrum, and from its own noise where that is louder (unless a
    /// smoothing is undone, whose gain hides it); motion comes in bursts, and rests let noise through that
    /// the mean motion would hide. The band ends where three neighbours lie near the
    /// noise; within it, lines that the long windows resolve keep their full height; every frequency is
    /// as open as those up to `reach` entries away. Steady machines are left out, and one that is known of.
    pub fn localise(
        &mut self,
        local: &[Spectrum],
        rate_hz: f64,
        undone: Option<ZeroPhaseSmoothing>,
        machine_hz: Option<f64>,
        reach: usize,
    ) {
        let mut mean = vec![0.0; self.filter.len()];
        let machines = steady_machines(local, &self.spectra[2].spectrum);
        self.windows = (0..local.len())
            .map(|window| {
                let spectrum = &local[window];
                let noise = match undone {
                    Some(_) => 1.0,
                    None => local_noise(spectrum, rate_hz, self.spectrum()),
                };
                let spectrum = with_ringing(local, window);
                let own = (&spectrum, noise);
                let machines = (machines.as_slice(), machine_hz);
                let filter = Filter {
                    spacing_hz: spectrum.spacing_hz,
                    weights: self.local_weights(own, machines, rate_hz, (undone, reach)),
                    noise,
                };
                for (k, sum) in mean.iter_mut().enumerate() {
                    *sum += filter.at(k as f64 * self.spacing_hz) / local.len() as f64;
                }
                filter
            })
            .collect();
        self.filter = mean;
    }

    /// Multiplies the filters by a factor of the frequency.
    pub fn multiply_filters(&mut self, factor: &dyn Fn(f64) -> f64) {
        for (k, weight) in self.filter.iter_mut().enumerate() {
            *weight *= factor(k as f64 * self.spacing_hz);
        }
        for filter in &mut self.windows {
            for (k, weight) in filter.weights.iter_mut().enumerate() {
                *weight *= factor(k as f64 * filter.spacing_hz);
            }
        }
    }

    /// Passes everything.
    pub fn open(&mut self) {
        self.filter.fill(1.0);
        for filter in &mut self.windows {
            filter.weights.fill(1.0);
        }
    }

    /// The filter's weights at the frequencies of one window's spectrum, whose noise is so many times as
    /// dense as that of the whole series, and at some of which machines are, or are known to be.
    fn local_weights(
        &self,
        (spectrum, noise): (&Spectrum, f64),
        machines: (&[bool], Option<f64>),
        rate_hz: f64,
        (undone, reach): (Option<ZeroPhaseSmoothing>, usize),
    ) -> Vec<f64> {
        let noise_at = |hz: f64| noise * self.noise_at(hz);
        let gain2 = |hz: f64| undoing_gain(hz, undone, rate_hz).powi(2);
        let bins = spectrum.density.len();
        let over_noise = |k: usize| {
            let hz = spectrum.frequency(k);
            spectrum.density[k] * gain2(hz) / noise_at(hz).max(TINY)
        };
        let ratio: Vec<f64> = (0..bins).map(over_noise).collect();
        let edge = (2..bins.saturating_sub(3))
            .find(|&k| ratio[k..k + 3].iter().all(|value| *value < LOCAL_EDGE))
            .unwrap_or(bins);
        let edge_hz = spectrum.frequency(edge);
        let lines = if self.shape.is_wandering() {
            vec![false; bins]
        } else {
            // Bumps of the noise would come back amplified: there, what stands beyond the band has to stand higher.
            let amplified = |k: usize| gain2(spectrum.frequency(k)).powf(0.25);
            let heights: Vec<f64> = (0..bins).map(|k| ratio[k] / amplified(k)).collect();
            lines_of_motion(&heights, edge, spectrum.spacing_hz, machines)
        };
        // Above what the noise is, at the last three frequencies of the band.
        let last = (1..=3)
            .filter_map(|back| ratio.get(edge.checked_sub(back)?))
            .sum::<f64>()
            / 3.0
            - 1.0;
        let beyond = |hz: f64| {
            let motion = last.max(0.0) * noise_at(edge_hz) * (edge_hz / hz).powf(MOTION_FALL);
            motion / (motion + noise_at(hz)).max(TINY)
        };
        let weight = |k: usize| {
            let hz = spectrum.frequency(k);
            if k < 2 {
                1.0
            } else if lines[k] && gain2(hz) <= LARGEST_GAIN.powi(2) {
                1.0 - 1.0 / ratio[k]
            } else if k >= edge && self.shape.falls() && undone.is_none() {
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
        };
        widened((0..bins).map(weight).collect(), reach)
    }

    /// Part of the motion at a frequency that the filter keeps, mean over the windows; none of what is faster than poses
    /// show.
    pub fn filter_at(&self, frequency_hz: f64) -> f64 {
        let place = frequency_hz / self.spacing_hz;
        if place > self.filter.len() as f64 {
            0.0
        } else {
            interpolated(&self.filter, place)
        }
    }

    /// One-sided density of the noise, unit^2/Hz.
    pub fn noise_at(&self, frequency_hz: f64) -> f64 {
        interpolated(&self.noise, frequency_hz / self.spacing_hz)
    }

    /// The mean spectrum with short windows, noise included.
    pub fn spectrum(&self) -> &Spectrum {
        &self.spectra[0].spectrum
    }
}

/// Which entries beyond the edge of the band are motion, by their heights over the noise, and not those of a machine.
fn lines_of_motion(
    heights: &[f64],
    edge: usize,
    spacing_hz: f64,
    (machines, machine_hz): (&[bool], Option<f64>),
) -> Vec<bool> {
    let mut motion = motion_beyond(heights, (LOCAL_EDGE, edge), spacing_hz, machines);
    if let Some(hz) = machine_hz {
        leave_out_machine(&mut motion, spacing_hz, hz);
    }
    motion
}

/// Wiener's filter `1 - N / S`, zero where S is hardly above N.
struct Wiener<'a> {
    /// Squared gain that undoes a smoothing.
    gain2: &'a dyn Fn(f64) -> f64,
    /// Density of the noise N after that.
    noise_at: &'a dyn Fn(f64) -> f64,
    /// End of the band of motion.
    edge_hz: f64,
}

impl Wiener<'_> {
    fn weight(&self, frequency_hz: f64, learnt: &LearntSpectrum) -> f64 {
        let gain2 = (self.gain2)(frequency_hz);
        let density = learnt.spectrum.at(frequency_hz) * gain2;
        let noise = (self.noise_at)(frequency_hz);
        let alone = if frequency_hz < self.edge_hz {
            learnt.noise_alone
        } else {
            learnt.noise_alone.max(NOISE_ALONE_BEYOND_BAND)
        };
        if density <= alone * noise || density <= 0.0 || gain2 > LARGEST_GAIN.powi(2) {
            0.0
        } else {
            1.0 - noise / density
        }
    }
}

/// The filter over the whole series: that of the short windows, opened around the lines that the
/// long ones resolve.
fn mean_filter(
    spectra: &[LearntSpectrum; 3],
    wiener: &Wiener<'_>,
    spacing_hz: f64,
    bins: usize,
) -> Vec<f64> {
    let [short, medium, long] = spectra.each_ref().map(|learnt| {
        (0..bins)
            .map(|k| wiener.weight(k as f64 * spacing_hz, learnt))
            .collect::<Vec<f64>>()
    });
    let lines: Vec<f64> = medium.iter().zip(long).map(|(a, b)| a.max(b)).collect();
    let reach = (LINE_REACH_HZ / spacing_hz).round() as usize;
    let mut filter = short;
    for (k, value) in filter.iter_mut().enumerate() {
        let around = &lines[k.saturating_sub(reach)..(k + reach + 1).min(bins)];
        *value = around.iter().copied().fold(*value, f64::max);
    }
    // Sharp edges ring for long.
    let mut filter = running_mean(&running_mean(&filter, reach), reach);
    for (k, value) in filter.iter_mut().enumerate() {
        // The mean and what is slower than a window is motion.
        if (k as f64) * spacing_hz < SLOWER_THAN_WINDOW * spectra[0].spectrum.spacing_hz {
            *value = 1.0;
        }
    }
    filter
}

/// The spectrum of a window with what its neighbours' motion rings there: a rest beside a burst would
/// otherwise have a filter that is narrow, and the burst would be smeared over it.
fn with_ringing(local: &[Spectrum], window: usize) -> Spectrum {
    let mut spectrum = local[window].clone();
    let from = window.saturating_sub(RINGING_REACH);
    let to = (window + RINGING_REACH).min(local.len() - 1);
    for other in &local[from..=to] {
        for (own, density) in spectrum.density.iter_mut().zip(&other.density) {
            *own = own.max(RINGING * density);
        }
    }
    spectrum
}

/// Every weight as large as those up to `reach` entries away.
fn widened(weights: Vec<f64>, reach: usize) -> Vec<f64> {
    if reach == 0 {
        return weights;
    }
    let largest_around = |k: usize| {
        let around = &weights[k.saturating_sub(reach)..(k + reach + 1).min(weights.len())];
        around.iter().copied().fold(0.0, f64::max)
    };
    (0..weights.len()).map(largest_around).collect()
}

/// Density of the noise that was there before a smoothing: where the undone spectrum is least, beyond
/// the slowest motion, as far as it stands above the noise since. What is least short of that is motion; a line stands above
/// it alone.
fn noise_before_smoothing(
    spectrum: &Spectrum,
    gain2: &dyn Fn(f64) -> f64,
    since: &NoiseShape,
) -> f64 {
    let all = SLOWEST_ENTRIES..spectrum.density.len();
    let stands_out =
        |k: &usize| spectrum.density[*k] > LOCAL_EDGE * since.at(spectrum.frequency(*k));
    let last = all.clone().rev().find(stands_out);
    let least = last.map_or(f64::INFINITY, |last| {
        (all.start..=last)
            .map(|k| spectrum.density[k] * gain2(spectrum.frequency(k)))
            .fold(f64::INFINITY, f64::min)
    });
    if least.is_finite() { least } else { 0.0 }
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

/// Where the band of motion ends, Hz: from there on three neighbours lie at the noise.
fn band_edge_hz(spectrum: &Spectrum, noise_at: &dyn Fn(f64) -> f64) -> f64 {
    let quiet = |k: usize| spectrum.density[k] < NOISE_ALONE[0] * noise_at(spectrum.frequency(k));
    let last = spectrum.density.len().saturating_sub(2);
    let first = (0..last)
        .find(|&k| quiet(k) && quiet(k + 1) && quiet(k + 2))
        .unwrap_or(spectrum.density.len());
    spectrum.frequency(first)
}
