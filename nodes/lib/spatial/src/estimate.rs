//! A continuous-time estimate of a motion from noisy poses, with its own uncertainty.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::holes::fill_holes;
use crate::segments::{Filter, HOP_S, Segments, centres};
use crate::spectrum::interpolated;
use crate::{FourierPair, KinematicTrack, SpatialError, Spectrum, Stamp, so3, welch};

/// Length of the windows from which the spectra are learnt, s, and below which multiple of the noise a spectrum counts as noise alone: three
/// standard errors over three axes of a minute. The longer ones resolve lines, which steady gaits and machines have.
const WINDOWS: [(f64, f64); 3] = [(5.0, 1.4), (20.0, 3.0), (f64::INFINITY, 8.0)];
/// How far the poses are continued beyond their ends, s.
const LEAD_S: f64 = 1.5;
/// Multiple of the noise at which a window's band of motion ends.
const LOCAL_EDGE: f64 = 1.6;
/// The same beyond the band of motion, where among hundreds of frequencies some reach three standard errors by chance, and where the second
/// derivative makes much of little.
const LONE_BAND: f64 = 2.2;
/// How far around a line the filter stays open, Hz: a line's amplitude changes over some seconds.
const LINE_HZ: f64 = 0.1;
/// Largest factor by which a smoothing that is undone may amplify: its true shape is nowhere written, and errors grow with it.
const LARGEST_GAIN: f64 = 8.0;
/// And what is still said of the gain that it would take.
const LARGEST_LOSS: f64 = 1000.0;

/// White noise of poses: standard deviation per sample and axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseNoise {
    /// m.
    pub position: f64,
    /// rad.
    pub rotation: f64,
}

/// A motion as poses at a steady rate report it, with what is noise in them told from what is motion.
///
/// Model: each coordinate (three of the position, four of the sign-continuous quaternion) is a stationary signal with white noise of density N.
/// N is the floor of the Welch spectrum S; Wiener's filter `W(f) = max(0, 1 - N / S(f))`, zero where S is hardly above N, gives the estimate with the
/// least mean square error, whose own error has the density `W N`. S is taken with short and long windows, whichever says more. Derivatives are taken in the Fourier domain, where they are exact.
/// Holes between samples are filled by the likeliest series of the same spectrum and are reported by [`PoseEstimate::gaps`].
#[derive(Clone, Debug)]
pub struct PoseEstimate {
    start: Stamp,
    rate_hz: f64,
    count: usize,
    /// Entries that the coordinates hold before the first pose and after the last.
    lead: usize,
    /// Position and sign-continuous quaternion on the grid, holes filled.
    coordinates: Arc<Vec<Vec<f64>>>,
    /// Spectra around each window's centre: of position, of rotation.
    local: Arc<[Vec<Spectrum>; 2]>,
    position: Floor,
    rotation: Floor,
    gaps: Vec<(Stamp, Stamp)>,
    /// Cutoff of a smoothing that is undone.
    undone_hz: Option<f64>,
}

/// What is noise in a spectrum.
#[derive(Clone, Debug)]
struct Floor {
    /// Mean spectra with short to long windows, and from which multiple of the noise on they show motion.
    spectra: Vec<(Spectrum, f64)>,
    /// One-sided density of the white floor of the poses as they are, mean over the coordinates.
    white: f64,
    /// Density of the noise after a smoothing is undone.
    noise: Vec<f64>,
    /// Wiener's filter, finer than the spectrum; its mean over the windows once these are known.
    filter: Vec<f64>,
    /// The filter of each window.
    windows: Vec<Filter>,
    /// Distance of the frequencies of filter and noise, Hz.
    spacing_hz: f64,
}

impl PoseEstimate {
    /// Learns from poses in the order of time: `stamps`, positions [m], rotations (world_from_segment).
    ///
    /// # Errors
    /// [`SpatialError::TooFewSamples`] below 16, [`SpatialError::TimeNotIncreasing`], [`SpatialError::NotFinite`],
    /// [`SpatialError::LengthMismatch`].
    pub fn fit(stamps: &[Stamp], positions: &[Vector3<f64>], rotations: &[UnitQuaternion<f64>]) -> Result<Self, SpatialError> {
        check(stamps, positions, rotations)?;
        let raster = Raster::new(stamps)?;
        let quaternions = so3::sign_continuous(rotations);
        let coordinates: Vec<Vec<f64>> = (0..7)
            .map(|channel| {
                let of = |index: usize| if channel < 3 { positions[index][channel] } else { quaternions[index].coords[channel - 3] };
                raster.resample(stamps, of)
            })
            .collect();
        Ok(Self::on_raster(&raster, coordinates))
    }

    fn on_raster(raster: &Raster, mut coordinates: Vec<Vec<f64>>) -> Self {
        let rate_hz = raster.rate_hz;
        let holes = raster.holes();
        let learn = |coordinates: &[Vec<f64>]| [Floor::learn(&coordinates[..3], rate_hz), Floor::learn(&coordinates[3..], rate_hz)];
        let mut floors = learn(&coordinates);
        // Twice, because the first spectra saw straight lines across the holes.
        for _ in 0..if holes.is_empty() { 0 } else { 2 } {
            let transform = FourierPair::new(FourierPair::good_length(raster.count + (4.0 * rate_hz) as usize));
            let (positions, quaternions) = coordinates.split_at_mut(3);
            fill_holes(positions, &holes, floors[0].spectrum(), &transform, rate_hz);
            fill_holes(quaternions, &holes, floors[1].spectrum(), &transform, rate_hz);
            floors = learn(&coordinates);
        }
        let local = [local_spectra(&coordinates[..3], rate_hz), local_spectra(&coordinates[3..], rate_hz)];
        let [mut position, mut rotation] = floors;
        // Beyond the ends as well: what is likely there keeps the last poses' derivatives sound.
        let lead = ((LEAD_S * rate_hz) as usize).min(300).min(raster.count / 4);
        let (positions, quaternions) = coordinates.split_at_mut(3);
        lengthen(positions, lead, position.spectrum(), rate_hz);
        lengthen(quaternions, lead, rotation.spectrum(), rate_hz);
        position.localise(&local[0], rate_hz, None);
        rotation.localise(&local[1], rate_hz, None);
        let (start, count, gaps) = (raster.start, raster.count, raster.gaps());
        Self { start, rate_hz, count, lead, coordinates: Arc::new(coordinates), local: Arc::new(local), position, rotation, gaps, undone_hz: None }
    }

    /// Time of the first pose.
    pub fn start(&self) -> Stamp {
        self.start
    }

    /// Time of the last pose.
    pub fn end(&self) -> Stamp {
        self.start.plus_seconds((self.count - 1) as f64 / self.rate_hz)
    }

    /// Rate of the poses, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Where poses are missing: the stamps of the poses before and after.
    pub fn gaps(&self) -> &[(Stamp, Stamp)] {
        &self.gaps
    }

    /// White noise of the poses. A rotation vector's variance per axis is 4/3 of the quaternion components' sum.
    pub fn noise(&self) -> PoseNoise {
        let sigma = |density: f64| (density * self.rate_hz / 2.0).sqrt();
        PoseNoise { position: sigma(self.position.white), rotation: sigma(self.rotation.white * 16.0 / 3.0) }
    }

    /// Mean spectra of position per axis [m2/Hz] and of the rotation vector per axis [rad2/Hz], noise included.
    pub fn spectra(&self) -> (Spectrum, Spectrum) {
        let mut rotation = self.rotation.spectrum().clone();
        rotation.density.iter_mut().for_each(|value| *value *= 16.0 / 3.0);
        (self.position.spectrum().clone(), rotation)
    }

    /// The estimate with a zero-phase smoothing of the poses undone (second-order Butterworth of this cutoff, forwards and backwards), up to a
    /// factor of 8.
    #[must_use]
    pub fn undoing(&self, cutoff_hz: f64) -> Self {
        let mut undone = self.clone();
        undone.position = self.position.undoing(cutoff_hz, self.rate_hz);
        undone.rotation = self.rotation.undoing(cutoff_hz, self.rate_hz);
        undone.position.localise(&self.local[0], self.rate_hz, Some(cutoff_hz));
        undone.rotation.localise(&self.local[1], self.rate_hz, Some(cutoff_hz));
        undone.undone_hz = Some(cutoff_hz);
        undone
    }

    /// One-sided density per axis of the estimate's error at a frequency: position [m2/Hz], rotation vector [rad2/Hz].
    pub fn error_density(&self, frequency_hz: f64) -> (f64, f64) {
        let density = |floor: &Floor| floor.noise_at(frequency_hz) * floor.filter_at(frequency_hz);
        (density(&self.position), density(&self.rotation) * 16.0 / 3.0)
    }

    /// Share of the motion at a frequency that the estimate keeps, of position and of rotation, and the gain that undoes a smoothing.
    pub fn filter_at(&self, frequency_hz: f64) -> (f64, f64, f64) {
        let gain = undo(frequency_hz, self.undone_hz, self.rate_hz);
        (self.position.filter_at(frequency_hz), self.rotation.filter_at(frequency_hz), gain.min(LARGEST_LOSS))
    }

    /// The kinematics on a grid of at least `least_rate_hz`, a whole multiple of the poses' rate, from the first pose to the last.
    pub fn track(&self, least_rate_hz: f64) -> KinematicTrack {
        let factor = (least_rate_hz / self.rate_hz).ceil().max(1.0) as usize;
        let rate_hz = self.rate_hz * factor as f64;
        let count = (self.count - 1) * factor + 1;
        let segments = Segments { rate_hz: self.rate_hz, factor, samples: self.count, lead: self.lead, count };
        let gain = |hz: f64| undo(hz, self.undone_hz, self.rate_hz).min(LARGEST_GAIN);
        let mut accelerations = Vec::new();
        for channel in 0..3 {
            accelerations.extend(segments.derivatives(&self.coordinates[channel], &self.position.windows, &gain, &[2]));
        }
        let (mut values, mut rates, mut seconds) = (Vec::new(), Vec::new(), Vec::new());
        for channel in 3..7 {
            let mut all = segments.derivatives(&self.coordinates[channel], &self.rotation.windows, &gain, &[0, 1, 2]).into_iter();
            values.extend(all.next());
            rates.extend(all.next());
            seconds.extend(all.next());
        }
        let quaternion = |of: &[Vec<f64>], k: usize| Quaternion::new(of[3][k], of[0][k], of[1][k], of[2][k]);
        let mut track = KinematicTrack { start: self.start, rate_hz, ..KinematicTrack::default() };
        for k in 0..count {
            let (q, q_dot, q_ddot) = (quaternion(&values, k), quaternion(&rates, k), quaternion(&seconds, k));
            let world_from_segment = UnitQuaternion::from_quaternion(q);
            let segment_from_world = world_from_segment.inverse();
            track.world_from_segment.push(world_from_segment);
            track.acceleration.push(segment_from_world * Vector3::new(accelerations[0][k], accelerations[1][k], accelerations[2][k]));
            track.angular_velocity.push(so3::angular_velocity_in_body(&q, &q_dot));
            track.angular_acceleration.push(segment_from_world * so3::angular_acceleration_in_world(&q, &q_dot, &q_ddot));
        }
        track
    }
}

/// Continues series by `lead` entries at both ends: oddly, then by what is likeliest under their spectrum.
fn lengthen(series: &mut [Vec<f64>], lead: usize, spectrum: &Spectrum, rate_hz: f64) {
    let count = series[0].len();
    for values in series.iter_mut() {
        let last = count - 1;
        let before = (1..=lead).rev().map(|k| 2.0 * values[0] - values[k.min(last)]);
        let after = (1..=lead).map(|k| 2.0 * values[last] - values[last - k.min(last)]);
        *values = before.chain(values.iter().copied()).chain(after).collect();
    }
    let transform = FourierPair::new(FourierPair::good_length(count + 2 * lead + (4.0 * rate_hz) as usize));
    fill_holes(series, &[0..lead, lead + count..count + 2 * lead], spectrum, &transform, rate_hz);
}

/// Gain that undoes a zero-phase second-order Butterworth smoothing, `1 / (1 + (f / fc)^4)`, with the frequencies as the bilinear transform bends
/// them at the poses' rate.
pub(crate) fn undo(frequency_hz: f64, undone_hz: Option<f64>, rate_hz: f64) -> f64 {
    undone_hz.map_or(1.0, |cutoff_hz| {
        let bent = |hz: f64| (std::f64::consts::PI * (hz / rate_hz).min(0.499)).tan();
        1.0 + (bent(frequency_hz) / bent(cutoff_hz)).powi(4)
    })
}

fn check(stamps: &[Stamp], positions: &[Vector3<f64>], rotations: &[UnitQuaternion<f64>]) -> Result<(), SpatialError> {
    for (what, found) in [("positions", positions.len()), ("rotations", rotations.len())] {
        if found != stamps.len() {
            return Err(SpatialError::LengthMismatch { what, expected: stamps.len(), found });
        }
    }
    if stamps.len() < 16 {
        return Err(SpatialError::TooFewSamples { got: stamps.len(), needed: 16 });
    }
    if let Some(index) = (1..stamps.len()).find(|&k| stamps[k] <= stamps[k - 1]) {
        let (previous, next) = (stamps[index - 1].as_seconds(), stamps[index].as_seconds());
        return Err(SpatialError::TimeNotIncreasing { index, previous, next });
    }
    let finite = |k: &usize| positions[*k].iter().chain(rotations[*k].coords.iter()).all(|value| value.is_finite());
    match (0..stamps.len()).find(|k| !finite(k)) {
        Some(index) => Err(SpatialError::NotFinite { index, what: "pose" }),
        None => Ok(()),
    }
}

/// A uniform grid through samples that may have holes.
struct Raster {
    start: Stamp,
    rate_hz: f64,
    count: usize,
    /// Position of each sample on the grid.
    places: Vec<f64>,
}

impl Raster {
    fn new(stamps: &[Stamp]) -> Result<Self, SpatialError> {
        let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_unstable_by(f64::total_cmp);
        let median = intervals[intervals.len() / 2];
        // The mean interval, holes counted by how many medians they span.
        let spans: f64 = stamps.windows(2).map(|pair| ((pair[1] - pair[0]) / median).round().max(1.0)).sum();
        let mean = (stamps[stamps.len() - 1] - stamps[0]) / spans;
        let interval = if (mean / median - 1.0).abs() < 0.02 { mean } else { median };
        let places: Vec<f64> = stamps.iter().map(|stamp| (*stamp - stamps[0]) / interval).collect();
        let count = places[places.len() - 1].round() as usize + 1;
        if count > 20_000_000 {
            return Err(SpatialError::TooManyStamps { count: count as f64, limit: 2e7, rate_hz: 1.0 / interval });
        }
        Ok(Self { start: stamps[0], rate_hz: 1.0 / interval, count, places })
    }

    /// Runs of entries without a sample.
    fn holes(&self) -> Vec<Range<usize>> {
        let between = |pair: &[f64]| (pair[0] + 0.5).ceil() as usize..(pair[1] - 0.5).ceil().max(0.0) as usize;
        self.places.windows(2).filter(|pair| pair[1] - pair[0] > 1.6).map(between).filter(|hole| !hole.is_empty()).collect()
    }

    fn gaps(&self) -> Vec<(Stamp, Stamp)> {
        let stamp = |place: f64| self.start.plus_seconds(place / self.rate_hz);
        self.places.windows(2).filter(|pair| pair[1] - pair[0] > 1.6).map(|pair| (stamp(pair[0]), stamp(pair[1]))).collect()
    }

    /// Values at the grid's entries: the sample itself where one lies there, else a cubic through the four around it (no more than linear next to
    /// a hole, so that nothing overshoots).
    fn resample(&self, stamps: &[Stamp], of: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut right = 0;
        (0..self.count)
            .map(|entry| {
                let place = entry as f64;
                while right + 1 < stamps.len() && self.places[right] < place {
                    right += 1;
                }
                let left = right.saturating_sub(1);
                let nearest = if (self.places[left] - place).abs() < (self.places[right] - place).abs() { left } else { right };
                if (self.places[nearest] - place).abs() < 0.01 {
                    return of(nearest);
                }
                let from = left.saturating_sub(1);
                let to = (right + 1).min(stamps.len() - 1);
                if to - from == 3 && self.places[to] - self.places[from] < 4.0 {
                    return lagrange(&self.places[from..=to], |k| of(from + k), place);
                }
                let span = self.places[right] - self.places[left];
                let share = if span > 0.0 { ((place - self.places[left]) / span).clamp(0.0, 1.0) } else { 0.0 };
                of(left) * (1.0 - share) + of(right) * share
            })
            .collect()
    }
}

fn lagrange(nodes: &[f64], of: impl Fn(usize) -> f64, place: f64) -> f64 {
    (0..nodes.len())
        .map(|k| {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != k);
            of(k) * others.map(|(_, node)| (place - node) / (nodes[k] - node)).product::<f64>()
        })
        .sum()
}

impl Floor {
    fn learn(coordinates: &[Vec<f64>], rate_hz: f64) -> Self {
        let count = coordinates[0].len();
        let spectra: Vec<(Spectrum, f64)> = WINDOWS
            .iter()
            .map(|&(seconds, alone)| {
                let window = if seconds.is_finite() { (seconds * rate_hz) as usize } else { count - 1 };
                let most = if seconds > 5.0 { count - 1 } else { count / 4 };
                (mean_spectrum(coordinates, rate_hz, window.min(most).max(8)), alone)
            })
            .collect();
        Self::from_spectra(spectra, rate_hz, None)
    }

    /// The floor after a smoothing of the poses is undone. The noise is what was added after the smoothing, amplified, or what was there before, a
    /// plateau of the undone spectrum; whichever is more.
    fn undoing(&self, cutoff_hz: f64, rate_hz: f64) -> Self {
        Self::from_spectra(self.spectra.clone(), rate_hz, Some(cutoff_hz))
    }

    fn from_spectra(spectra: Vec<(Spectrum, f64)>, rate_hz: f64, undone_hz: Option<f64>) -> Self {
        let spectrum = &spectra[0].0;
        let gain2 = |frequency_hz: f64| undo(frequency_hz, undone_hz, rate_hz).powi(2);
        let floor = noise_floor(spectrum, rate_hz);
        // Where the undone spectrum is least, beyond the slowest motion, lies the noise that was there before.
        let usable = (3..spectrum.density.len()).map(|k| (spectrum.frequency(k), spectrum.density[k])).filter(|(hz, _)| gain2(*hz) <= LARGEST_GAIN.powi(2));
        let before = undone_hz.map_or(0.0, |_| usable.map(|(hz, density)| density * gain2(hz)).fold(f64::INFINITY, f64::min));
        let before = if before.is_finite() { before } else { 0.0 };
        let noise_at = |frequency_hz: f64| (floor * gain2(frequency_hz)).max(before);
        let spacing_hz = spectra[2].0.spacing_hz.min(spectrum.spacing_hz);
        let edge_hz = edge(spectrum, &|hz| noise_at(hz) / gain2(hz));
        let bins = (rate_hz / 2.0 / spacing_hz) as usize + 1;
        let weight = |frequency_hz: f64, (spectrum, alone): &(Spectrum, f64)| {
            let density = spectrum.at(frequency_hz) * gain2(frequency_hz);
            let noise = noise_at(frequency_hz);
            let alone = if frequency_hz < edge_hz { *alone } else { alone.max(LONE_BAND) };
            if density <= alone * noise || density <= 0.0 || gain2(frequency_hz) > LARGEST_GAIN.powi(2) { 0.0 } else { 1.0 - noise / density }
        };
        let of = |which: usize| (0..bins).map(|k| weight(k as f64 * spacing_hz, &spectra[which])).collect::<Vec<f64>>();
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
        let noise = (0..bins).map(|k| noise_at(k as f64 * spacing_hz).min(floor.max(before) * LARGEST_GAIN.powi(2))).collect();
        Self { white: floor, spectra, noise, filter, windows: Vec::new(), spacing_hz }
    }

    /// A filter for each window from its own spectrum; motion comes in bursts, and rests let noise through that the mean motion would hide.
    /// The band ends where three neighbours lie near the noise; within it, lines that the long windows resolve keep their full height.
    fn localise(&mut self, local: &[Spectrum], rate_hz: f64, undone_hz: Option<f64>) {
        let gain2 = |hz: f64| undo(hz, undone_hz, rate_hz).powi(2);
        let mut mean = vec![0.0; self.filter.len()];
        self.windows = local
            .iter()
            .map(|spectrum| {
                let ratio: Vec<f64> =
                    spectrum.density.iter().enumerate().map(|(k, density)| {
                        let hz = spectrum.frequency(k);
                        density * gain2(hz) / self.noise_at(hz).max(1e-300)
                    }).collect();
                let bins = ratio.len();
                let edge = (2..bins.saturating_sub(3)).find(|&k| ratio[k..k + 3].iter().all(|value| *value < LOCAL_EDGE)).unwrap_or(bins);
                let weights: Vec<f64> = (0..bins)
                    .map(|k| {
                        let hz = spectrum.frequency(k);
                        if k < 2 {
                            1.0
                        } else if k >= edge || ratio[k] <= 1.0 || gain2(hz) > LARGEST_GAIN.powi(2) {
                            0.0
                        } else {
                            let own = 1.0 - 1.0 / ratio[k];
                            if ratio[k] > LOCAL_EDGE { own.max(self.filter_at(hz)) } else { own }
                        }
                    })
                    .collect();
                let filter = Filter { spacing_hz: spectrum.spacing_hz, weights };
                for (k, sum) in mean.iter_mut().enumerate() {
                    *sum += filter.at(k as f64 * self.spacing_hz) / local.len() as f64;
                }
                filter
            })
            .collect();
        self.filter = mean;
    }

    fn filter_at(&self, frequency_hz: f64) -> f64 {
        interpolated(&self.filter, frequency_hz / self.spacing_hz)
    }

    fn noise_at(&self, frequency_hz: f64) -> f64 {
        interpolated(&self.noise, frequency_hz / self.spacing_hz)
    }

    fn spectrum(&self) -> &Spectrum {
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
fn local_spectra(coordinates: &[Vec<f64>], rate_hz: f64) -> Vec<Spectrum> {
    let count = coordinates[0].len();
    let length = ((2.0 * HOP_S * rate_hz) as usize).min(count);
    centres(count, rate_hz)
        .into_iter()
        .map(|centre| {
            let from = centre.saturating_sub(length / 2).min(count - length);
            let parts: Vec<Vec<f64>> = coordinates.iter().map(|series| series[from..from + length].to_vec()).collect();
            let spectrum = mean_spectrum(&parts, rate_hz, length - 1);
            let density = (0..spectrum.density.len())
                .map(|k| {
                    let near = |step: usize| 0.5 * (spectrum.density[k.saturating_sub(step)] + spectrum.density[(k + step).min(spectrum.density.len() - 1)]);
                    // Not where the spectrum is steep: its slope would spill into the noise.
                    let smooth = (spectrum.density[k] * 3.0 + near(1) * 4.0 + near(2) * 2.0) / 9.0;
                    smooth.min(4.0 * spectrum.density[k].max(near(1).min(spectrum.density[k] * 4.0)))
                })
                .collect();
            Spectrum { density, ..spectrum }
        })
        .collect()
}

/// Where the band of motion ends: from there on three neighbours lie at the noise.
fn edge(spectrum: &Spectrum, noise_at: &dyn Fn(f64) -> f64) -> f64 {
    let quiet = |k: usize| spectrum.density[k] < WINDOWS[0].1 * noise_at(spectrum.frequency(k));
    let last = spectrum.density.len().saturating_sub(2);
    let first = (0..last).find(|&k| quiet(k) && quiet(k + 1) && quiet(k + 2)).unwrap_or(spectrum.density.len());
    spectrum.frequency(first)
}

/// Mean Welch spectrum of several coordinates.
fn mean_spectrum(coordinates: &[Vec<f64>], rate_hz: f64, window: usize) -> Spectrum {
    let mut mean = Spectrum::default();
    for series in coordinates {
        // Differences first: a steep spectrum would leak through the window. Undone by |2 sin(pi f / rate)|^2.
        let differences: Vec<f64> = series.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let spectrum = welch(&differences, rate_hz, window);
        if mean.density.is_empty() {
            mean = Spectrum { density: vec![0.0; spectrum.density.len()], ..spectrum };
        }
        for (k, sum) in mean.density.iter_mut().enumerate() {
            let gain = 2.0 * (std::f64::consts::PI * k.max(1) as f64 * spectrum.spacing_hz / rate_hz).sin();
            *sum += spectrum.density[k] / (gain * gain * coordinates.len() as f64);
        }
    }
    mean
}

/// Density of the white floor: the median between 70 and 97 % of Nyquist, where that is flat; else (poses that were resampled or filtered) the
/// highest band further down in which the density stays level.
fn noise_floor(spectrum: &Spectrum, rate_hz: f64) -> f64 {
    let nyquist_hz = rate_hz / 2.0;
    let level = |from: f64, to: f64| spectrum.median(from * nyquist_hz, to * nyquist_hz).unwrap_or(0.0);
    let top = level(0.70, 0.97);
    let mut upper = 0.97;
    while upper > 0.3 {
        let (high, low) = (level(upper - 0.12, upper), level(upper - 0.24, upper - 0.12));
        if low < 1.5 * high && high > 0.5 * top {
            return if upper > 0.96 { top } else { 0.5 * (high + low) };
        }
        upper -= 0.04;
    }
    top
}

#[cfg(test)]
#[path = "estimate_tests.rs"]
mod tests;
