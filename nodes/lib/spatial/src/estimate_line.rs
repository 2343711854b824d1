//! A line in the spectrum of poses: motion that goes on at one frequency for all of the time.

use std::f64::consts::{PI, TAU};

use crate::PoseEstimate;

/// Entries of the spectrum on either side where the line itself is sought: another clock may be off by as much.
const NEAR: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];
/// And where its surroundings are, beyond what the window smears.
const AROUND: [f64; 6] = [-10.0, -7.0, -4.0, 4.0, 7.0, 10.0];

/// What poses have at one frequency, in units of their second derivative (of positions, m2/s4) or first
/// (of rotations, rad2/s2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseLine {
    /// Mean square of the sinusoid, summed over the axes.
    pub power: f64,
    /// Over the median of the surroundings.
    pub height: f64,
}

impl PoseEstimate {
    /// The line of the positions and that of the rotations at a frequency, by a Fourier sum over all poses under
    /// Hann's window: white noise of N poses leaves 3 / N of its variance there. Beyond the Nyquist frequency it is the
    /// line that folds back, as of motion at the frequency itself. None from the poses' rate on.
    pub fn lines_at(&self, hz: f64) -> Option<[PoseLine; 2]> {
        let spacing_hz = self.rate_hz() / self.len() as f64;
        if hz + AROUND[5] * spacing_hz >= self.rate_hz() || hz + AROUND[0] * spacing_hz <= 0.0 {
            return None;
        }
        let squared = (TAU * hz).powi(2);
        // |w|^2 = 4 |dq/dt|^2.
        let parts = [(0..3, squared * squared), (3..7, 4.0 * squared)];
        Some(parts.map(|(axes, factor)| {
            let power = |entries: f64| -> f64 {
                let axes = axes.clone();
                let hz = hz + entries * spacing_hz;
                axes.map(|axis| self.mean_square_at(axis, hz)).sum()
            };
            let mut around = AROUND.map(power);
            around.sort_unstable_by(f64::total_cmp);
            let median = 0.5 * (around[2] + around[3]);
            let line = NEAR.map(power).into_iter().fold(0.0, f64::max);
            PoseLine {
                power: factor * line,
                height: line / median.max(f64::MIN_POSITIVE),
            }
        }))
    }

    /// Of a coordinate's sinusoid, by Goertzel's recursion; second differences first, as a steep spectrum would
    /// leak through the window, undone by their gain.
    fn mean_square_at(&self, axis: usize, hz: f64) -> f64 {
        let series = self.poses_of(axis);
        let count = series.len().saturating_sub(2);
        let turn = TAU * hz / self.rate_hz();
        let rotation = 2.0 * turn.cos();
        let (mut last, mut before) = (0.0, 0.0);
        for (k, three) in series.array_windows::<3>().enumerate() {
            let window = (PI * (k as f64 + 0.5) / count as f64).sin().powi(2);
            let value = three[0] - 2.0 * three[1] + three[2];
            (last, before) = (rotation * last - before + window * value, last);
        }
        let squared = last * last + before * before - rotation * last * before;
        let gain = 2.0 - rotation;
        // Half of the amplitude's square; the window's mean is a half.
        8.0 * squared / (count as f64 * gain).powi(2)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::TAU;

    use nalgebra::{UnitQuaternion, Vector3};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha12Rng;

    use crate::{PoseEstimate, Stamp};

    /// Of a body that sways by metres and trembles by 50 um and 0.2 mrad at 5.4 Hz, amid 0.3 mm and 0.05 degrees.
    #[test]
    fn a_line_below_the_noise_of_poses_has_its_power() {
        let mut random = ChaCha12Rng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let hz = 5.4;
        let (mut stamps, mut positions, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..120 * 60 {
            let t = f64::from(k) / 120.0;
            stamps.push(Stamp::default().plus_seconds(t));
            let wave = (TAU * hz * t).sin();
            let noise = Vector3::from_fn(|_, _| 3e-4 * normal());
            positions.push(Vector3::new((0.7 * t).sin(), 5e-5 * wave, 0.1 * t) + noise);
            let noise = Vector3::from_fn(|_, _| 9e-4 * normal());
            let turned = Vector3::new((0.4 * t).sin(), 0.0, 0.0);
            rotations.push(
                UnitQuaternion::from_scaled_axis(turned)
                    * UnitQuaternion::from_scaled_axis(Vector3::z() * 2e-4 * wave + noise),
            );
        }
        let estimate = PoseEstimate::fit(&stamps, &positions, &rotations).unwrap();
        let [position, rotation] = estimate.lines_at(hz).unwrap();
        let expected = 0.5 * (5e-5 * (TAU * hz).powi(2)).powi(2);
        assert!(
            (position.power / expected - 1.0).abs() < 0.3,
            "{position:?}"
        );
        let expected = 0.5 * (2e-4 * TAU * hz).powi(2);
        assert!(
            (rotation.power / expected - 1.0).abs() < 0.4,
            "{rotation:?}"
        );
        // Among noise of 3 / N of its variance they stand 11 and 20 times as high as that.
        let heights = [position.height, rotation.height];
        assert!(heights.iter().all(|height| *height > 6.0), "{heights:?}");
        let [position, rotation] = estimate.lines_at(7.3).unwrap();
        let heights = [position.height, rotation.height];
        assert!(heights.iter().all(|height| *height < 6.0), "{heights:?}");
        let folded = estimate.lines_at(120.0 - hz).unwrap();
        assert!(folded.iter().all(|line| line.height > 6.0), "{folded:?}");
        assert_eq!(estimate.lines_at(119.9), None);
    }
}
