//! What a real IMU shows above the frequency that poses resolve: impacts, tremor, soft tissue. It is
//! drawn, not known.
//!
//! ```text
//! density(f, t) = model(segment, f, vigour(t)) (1 - H(f, t)^2)        H = 1 / (1 + (f / bandwidth(t))^10), the smoothing's response
//! ```
//! so that spectra of the motion's own part and of the drawn one add up to the model's above the bandwidth.
//! Bands of a third of an octave, white in each, rise and fall with what of the motion is resolved.

mod model;

use cromosim_spatial::{Complex64, FourierPair};
use nalgebra::Vector3;

pub use self::model::TextureSegment;
use self::model::{ChannelTexture, HIGHEST_FITTED_HZ};
use crate::random::{normal_pair, stream};
use crate::{Bandwidth, KinematicSample, median_bandwidth};

/// Of the random numbers, beside those of the noise and of lost samples.
const TEXTURE_CHANNELS: [u64; 2] = [4, 5];
/// Time over which the vigour is taken, s: as in the fit.
const VIGOUR_S: f64 = 1.28;
/// Lowest edge of the bands, Hz; whole motions are resolved below.
const LOWEST_HZ: f64 = 2.5;
const BANDS_PER_OCTAVE: f64 = 3.0;

/// What was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnTexture {
    /// On what.
    pub segment: TextureSegment,
    /// From which frequency on, median: there the drawn part's density passes three quarters of the
    /// model's.
    pub from: Bandwidth,
}

/// Draws texture onto samples at a constant rate, and adds to their variances what it may be off by: its own
/// and that of the motion in whose place it stands. None, and nothing drawn, where the samples do not say
/// what they resolve.
///
/// `seed` and `name` (of the placement) choose the numbers.
pub fn add_texture(
    motion: &mut [KinematicSample],
    segment: TextureSegment,
    (seed, name): (u64, &str),
) -> Option<DrawnTexture> {
    let from = median_bandwidth(motion)?;
    let seconds = motion.last()?.stamp - motion.first()?.stamp;
    if seconds <= 0.0 {
        return None;
    }
    let rate_hz = (motion.len() - 1) as f64 / seconds;
    for (channel, texture) in segment.channels().iter().enumerate() {
        let drawn = Drawn {
            texture,
            rate_hz,
            bandwidths: &bandwidths(motion, channel),
            growth: &growth(motion, channel, texture, rate_hz),
        };
        let mut random = stream(seed, name, TEXTURE_CHANNELS[channel]);
        let mut white = || normal_pair(&mut random)[0];
        let axes: [Vec<f64>; 3] = std::array::from_fn(|_| drawn.axis(&mut white));
        let variances = drawn.variances();
        for k in 0..motion.len() {
            let at = |k: usize| Vector3::new(axes[0][k], axes[1][k], axes[2][k]);
            let (before, after) = (k.saturating_sub(1), (k + 1).min(motion.len() - 1));
            let slope = (at(after) - at(before)) * (rate_hz / (after - before) as f64);
            add(&mut motion[k], channel, [at(k), slope], 2.0 * variances[k]);
        }
    }
    Some(DrawnTexture { segment, from })
}

fn add(
    sample: &mut KinematicSample,
    channel: usize,
    [value, slope]: [Vector3<f64>; 2],
    variance: f64,
) {
    let rotation = sample.world_from_sensor.rotation;
    if channel == 0 {
        sample.acceleration_in_world += rotation * value;
        sample.variance.acceleration += variance;
        return;
    }
    sample.angular_velocity_in_world += rotation * value;
    if let Some(turning) = &mut sample.angular_acceleration_in_world {
        *turning += rotation * slope;
    }
    sample.variance.angular_velocity += variance;
}

fn bandwidths(motion: &[KinematicSample], channel: usize) -> Vec<f64> {
    let of = |sample: &KinematicSample| {
        let bandwidth = sample.bandwidth?;
        Some([bandwidth.acceleration_hz, bandwidth.angular_velocity_hz][channel])
    };
    motion
        .iter()
        .map(|sample| of(sample).unwrap_or(f64::INFINITY))
        .collect()
}

/// What the density grows by around each sample.
fn growth(
    motion: &[KinematicSample],
    channel: usize,
    texture: &ChannelTexture,
    rate_hz: f64,
) -> Vec<f64> {
    let read = |sample: &KinematicSample| {
        let reading = sample.imu();
        [reading.specific_force, reading.angular_velocity][channel]
    };
    // Sums of values and squares before each sample.
    let mut sums = vec![(Vector3::zeros(), 0.0)];
    for sample in motion {
        let (sum, square) = sums[sums.len() - 1];
        let value = read(sample);
        sums.push((sum + value, square + value.norm_squared()));
    }
    let half = (0.5 * VIGOUR_S * rate_hz).round() as usize;
    let at = |k: usize| {
        let (from, to) = (k.saturating_sub(half), (k + half + 1).min(motion.len()));
        let count = (to - from) as f64;
        let mean = (sums[to].0 - sums[from].0) / count;
        let square = (sums[to].1 - sums[from].1) / count;
        texture.growth(((square - mean.norm_squared()) / 3.0).max(0.0))
    };
    (0..motion.len()).map(at).collect()
}

/// A channel that is to be drawn.
struct Drawn<'a> {
    texture: &'a ChannelTexture,
    rate_hz: f64,
    bandwidths: &'a [f64],
    growth: &'a [f64],
}

impl Drawn<'_> {
    /// Edges of the bands, Hz.
    fn bands(&self) -> Vec<[f64; 2]> {
        let highest = HIGHEST_FITTED_HZ.min(0.5 * self.rate_hz);
        let edge = |k: i32| LOWEST_HZ * (f64::from(k) / BANDS_PER_OCTAVE).exp2();
        (0..)
            .map(|k| [edge(k), edge(k + 1).min(highest)])
            .take_while(|[low, high]| low < high)
            .collect()
    }

    /// What factor stands before a band's amplitude at a sample.
    fn gain(&self, [low, high]: [f64; 2], k: usize) -> f64 {
        let response = 1.0 / (1.0 + ((low * high).sqrt() / self.bandwidths[k]).powi(10));
        (self.growth[k] * (1.0 - response * response)).sqrt()
    }

    /// One axis.
    fn axis(&self, white: &mut impl FnMut() -> f64) -> Vec<f64> {
        let count = self.growth.len();
        let fourier = FourierPair::new(FourierPair::good_length(count));
        let length = fourier.length();
        let mut spectrum: Vec<Complex64> =
            (0..length).map(|_| Complex64::new(white(), 0.0)).collect();
        fourier.forward(&mut spectrum);
        let mut axis = vec![0.0; count];
        for band in self.bands() {
            let shaped = |(bin, value): (usize, &Complex64)| {
                let frequency = bin.min(length - bin) as f64 * self.rate_hz / length as f64;
                let inside = (band[0]..band[1]).contains(&frequency);
                // White numbers of variance one have the density 2 / rate.
                let density = if inside {
                    self.texture.density(frequency)
                } else {
                    0.0
                };
                value * (density * 0.5 * self.rate_hz).sqrt()
            };
            let mut values: Vec<Complex64> = spectrum.iter().enumerate().map(shaped).collect();
            fourier.inverse(&mut values);
            for (k, axis) in axis.iter_mut().enumerate() {
                *axis += self.gain(band, k) * values[k].re;
            }
        }
        axis
    }

    /// Expected square of each sample, per axis.
    fn variances(&self) -> Vec<f64> {
        let mut variances = vec![0.0; self.growth.len()];
        for band in self.bands() {
            let [low, high] = band;
            let power = self.texture.density((low * high).sqrt()) * (high - low);
            for (k, variance) in variances.iter_mut().enumerate() {
                *variance += self.gain(band, k).powi(2) * power;
            }
        }
        variances
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
