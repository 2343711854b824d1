//! How far a [`PoseEstimate`] may be off at each time.

use std::f64::consts::{PI, TAU};

use crate::estimate::QUATERNION_PER_ROTVEC;
use crate::noise_floor::NoiseFloor;
use crate::segments::{Filter, HOP_S};
use crate::{PoseEstimate, SampleVariance, Stamp};

/// Variances around one window's centre: of the value, and of its first and second derivative.
type Variances = [f64; 3];

/// How far the errors of what is filled in reach into the poses beside it, s: their variance falls by a
/// factor of e within so much.
const REACH_S: f64 = 0.012;
/// Seen no more after so many of it.
const FARTHEST: f64 = 6.0;

/// How errors of poses come to a sensor.
pub struct ErrorPath<'p> {
    /// Of which units of the positions a metre has so many.
    pub units_per_metre: f64,
    /// From the poses' origin to the sensor, m.
    pub lever_arm_m: f64,
    /// Part of the power at a frequency (Hz) that the sensor passes, of the angular velocity and of
    /// the acceleration.
    pub passed: &'p dyn Fn(f64) -> [f64; 2],
}

impl PoseEstimate {
    /// Variances, along or about each axis, that the poses' noise leaves in what a sensor feels, at times
    /// in order.
    ///
    /// With N the noise's density, W a window's filter (see [`PoseEstimate`]) and P what the sensor passes
    /// the n-th derivative errs by `integral N W P (2 pi f)^(2 n) df`; windows are cross-faded as the
    /// motion is. An error of the angular acceleration moves the sensor by two thirds of its square times
    /// the arm's, mean over directions. Where poses are missing, or beyond their ends, the errors of what is filled in
    /// (its covariance under the mean spectrum) come on top, and motion that is too fast for the poses, where their spectrum tells
    /// of it. What the filter takes for noise though it is motion is not in it.
    pub fn variances(&self, stamps: &[Stamp], path: &ErrorPath<'_>) -> Vec<SampleVariance> {
        let of_windows = |floor: &NoiseFloor| -> Vec<Variances> {
            let windows = floor.windows.iter();
            let through = |filter| through(floor, filter, path.passed);
            windows.map(through).collect()
        };
        let (positions, rotations) = (of_windows(&self.position), of_windows(&self.rotation));
        let at = |stamp: &Stamp| {
            let place = ((*stamp - self.start) / HOP_S).max(0.0);
            let [of_position, of_rotation] = self.filled_in(*stamp);
            let [_, _, acceleration] = sum(faded(&positions, place), of_position);
            let [rotation, turning, spinning_up] = sum(faded(&rotations, place), of_rotation)
                .map(|variance| variance / QUATERNION_PER_ROTVEC);
            SampleVariance {
                acceleration: acceleration / path.units_per_metre.powi(2)
                    + 2.0 / 3.0 * path.lever_arm_m.powi(2) * spinning_up,
                angular_velocity: turning,
                orientation: rotation,
                ..SampleVariance::default()
            }
        };
        stamps.iter().map(at).collect()
    }
}

impl PoseEstimate {
    /// What is added where poses are missing, or close by: of position, of the quaternion.
    fn filled_in(&self, stamp: Stamp) -> [Variances; 2] {
        let next = self.filled.partition_point(|filled| filled.to < stamp);
        // The one before is done with, and may still reach here.
        let near = self.filled[next.saturating_sub(1)..].iter().take(2);
        let mut added = [Variances::default(); 2];
        for filled in near {
            let inside = (stamp - filled.from).min(filled.to - stamp);
            let reach = (inside.min(0.0) / REACH_S).exp();
            if inside > -FARTHEST * REACH_S {
                for (sums, errors) in added.iter_mut().zip(&filled.errors) {
                    *sums = sum(*sums, at_depth(errors, inside).map(|own| own * reach));
                }
            }
        }
        added
    }
}

fn sum(one: Variances, other: Variances) -> Variances {
    std::array::from_fn(|n| one[n] + other[n])
}

/// Between the depths that are known, straight; beyond them the nearest one's.
fn at_depth(errors: &[(f64, Variances)], depth: f64) -> Variances {
    let next = errors.partition_point(|(known, _)| *known < depth);
    match (next.checked_sub(1).map(|k| errors[k]), errors.get(next)) {
        (Some((before, own)), Some((after, others))) => {
            let share = (depth - before) / (after - before);
            std::array::from_fn(|n| own[n] * (1.0 - share) + others[n] * share)
        }
        (Some((_, only)), None) => only,
        (None, Some((_, only))) => *only,
        (None, None) => Variances::default(),
    }
}

/// What a filter and a sensor let through of the noise, and the sensor of motion that is too fast for the poses.
fn through(floor: &NoiseFloor, filter: &Filter, passed: &dyn Fn(f64) -> [f64; 2]) -> Variances {
    let mut sums = Variances::default();
    let mut add = |frequency_hz: f64, density: f64| {
        let mut power = density * filter.noise * filter.spacing_hz;
        let [of_rate, of_acceleration] = passed(frequency_hz);
        for (sum, passed) in sums.iter_mut().zip([1.0, of_rate, of_acceleration]) {
            *sum += power * passed;
            power *= (TAU * frequency_hz).powi(2);
        }
    };
    let bins = filter.weights.len();
    for (k, weight) in filter.weights.iter().enumerate() {
        let frequency_hz = k as f64 * filter.spacing_hz;
        add(frequency_hz, floor.noise_at(frequency_hz) * weight);
    }
    // An octave: by the power law it would grow on, and no motion does.
    for k in bins..2 * bins {
        let frequency_hz = k as f64 * filter.spacing_hz;
        add(frequency_hz, floor.shape.motion_beyond(frequency_hz));
    }
    sums
}

/// At a place counted in windows, by raised cosines between neighbours.
fn faded(windows: &[Variances], place: f64) -> Variances {
    let Some(last) = windows.len().checked_sub(1) else {
        return Variances::default();
    };
    let first = (place as usize).min(last);
    let next = (first + 1).min(last);
    let share = 0.5 - 0.5 * (PI * (place - first as f64).min(1.0)).cos();
    std::array::from_fn(|n| windows[first][n] * (1.0 - share) + windows[next][n] * share)
}
