//! What errors of the poses leave in a sample.

use cromosim_spatial::{Influence, SampleWeights, Stamp, derivative_weights};
use nalgebra::{Matrix3, Vector3};

use crate::schemes::StencilScheme;
use crate::schemes::stencil::stencil_range;
use crate::{Covariances, ImuSample, PoseStd, SampleVariance, SensorFrame};

/// A frame that is not known spoils a sample where it makes up more than this part of the squared
/// weights.
const SPOILING_SHARE: f64 = 0.01;

/// How a scheme weighs frames in a sample, first order in their errors.
#[derive(Clone, Debug)]
pub(crate) struct FrameWeights {
    /// First frame.
    pub first: usize,
    /// Of each frame: its orientation in the sample's, its rotation in the angular velocity (1/s),
    /// its position in the acceleration (1/s2).
    pub rows: Vec<[f64; 3]>,
}

impl FrameWeights {
    /// Those of a stencil at any stamp: its own weights at a frame, in between those of the four
    /// estimates around it.
    pub(crate) fn by_stencil(scheme: StencilScheme, frames: &[SensorFrame], stamp: Stamp) -> Self {
        let after = frames
            .partition_point(|frame| frame.stamp < stamp)
            .min(frames.len() - 1);
        if frames[after].stamp == stamp {
            return Self::at_frame(scheme, frames, after);
        }
        let width = frames.len().min(4);
        let start = after.saturating_sub(2).min(frames.len() - width);
        let mut seconds = [0.0; 4];
        for (seconds, frame) in seconds.iter_mut().zip(&frames[start..]) {
            *seconds = frame.stamp - stamp;
        }
        let between = derivative_weights(&seconds[..width], 0.0)[0];
        let estimates: Vec<Self> = (start..start + width)
            .map(|k| Self::at_frame(scheme, frames, k))
            .collect();
        let first = estimates
            .iter()
            .map(|estimate| estimate.first)
            .min()
            .unwrap_or(start);
        let end = estimates
            .iter()
            .map(|estimate| estimate.first + estimate.rows.len())
            .max()
            .unwrap_or(start);
        let mut rows = vec![[0.0; 3]; end - first];
        for (estimate, share) in estimates.iter().zip(between) {
            for (row, weights) in rows[estimate.first - first..]
                .iter_mut()
                .zip(&estimate.rows)
            {
                (0..3).for_each(|m| row[m] += share * weights[m]);
            }
        }
        Self { first, rows }
    }

    fn at_frame(scheme: StencilScheme, frames: &[SensorFrame], k: usize) -> Self {
        let range = stencil_range(frames.len(), k, scheme.reach());
        let mut seconds = [0.0; cromosim_spatial::MAX_STENCIL];
        for (seconds, frame) in seconds.iter_mut().zip(&frames[range.clone()]) {
            *seconds = frame.stamp - frames[k].stamp;
        }
        let [_, slope, second] = derivative_weights(&seconds[..range.len()], 0.0);
        let row = |j: usize| {
            [
                if range.start + j == k { 1.0 } else { 0.0 },
                slope[j],
                second[j],
            ]
        };
        Self {
            first: range.start,
            rows: (0..range.len()).map(row).collect(),
        }
    }

    /// Of a spline whose position and rotation have their own smoothing. The quaternion moves by
    /// half the turn, and the angular velocity is twice its derivative, so that the weights are
    /// those of the channels.
    pub(crate) fn by_spline(position: &Influence, rotation: &Influence, seconds: f64) -> Self {
        let (places, turns) = (position.at(seconds), rotation.at(seconds));
        let first = places.first.min(turns.first);
        let end = (places.first + places.rows.len()).max(turns.first + turns.rows.len());
        let row = |weights: &SampleWeights, k: usize| {
            k.checked_sub(weights.first)
                .and_then(|k| weights.rows.get(k))
                .copied()
        };
        let rows = (first..end).map(|k| {
            let [value, slope, _] = row(&turns, k).unwrap_or_default();
            let [_, _, second] = row(&places, k).unwrap_or_default();
            [value, slope, second]
        });
        Self {
            first,
            rows: rows.collect(),
        }
    }

    /// The variances that the frames' errors leave: `sum_ij w_i w_j s_i s_j correlation(t_i -
    /// t_j)`.
    pub(crate) fn variance(&self, frames: &[SensorFrame]) -> SampleVariance {
        let frames = &frames[self.first..self.first + self.rows.len()];
        let sum = |m: usize, std: fn(&PoseStd) -> f64| {
            variance(frames, self.rows.iter().map(|row| row[m]).collect(), std)
        };
        SampleVariance {
            orientation: sum(0, |std| std.rotation_rad),
            angular_velocity: sum(1, |std| std.rotation_rad),
            acceleration: sum(2, |std| std.position_m),
            ..SampleVariance::default()
        }
    }
}

fn variance(frames: &[SensorFrame], weights: Vec<f64>, std: fn(&PoseStd) -> f64) -> f64 {
    let total: f64 = weights.iter().map(|w| w * w).sum();
    let mut errors = Vec::with_capacity(frames.len());
    for (frame, w) in frames.iter().zip(weights) {
        let std = std(&frame.pose_std);
        if std.is_finite() {
            errors.push((frame.stamp, w * std));
        } else if w * w > SPOILING_SHARE * total {
            return f64::INFINITY;
        }
    }
    let correlation_s = frames
        .iter()
        .map(|frame| frame.pose_std.correlation_s)
        .fold(0.0, f64::max);
    if correlation_s == 0.0 {
        return errors.iter().map(|(_, error)| error * error).sum();
    }
    let pair = |(one, a): &(Stamp, f64), (other, b): &(Stamp, f64)| {
        a * b * (-0.5 * ((*one - *other) / correlation_s).powi(2)).exp()
    };
    let sum: f64 = errors
        .iter()
        .map(|one| errors.iter().map(|other| pair(one, other)).sum::<f64>())
        .sum();
    // Weights that nearly cancel may leave a rounding error below 0.
    sum.max(0.0)
}

/// Whether errors of any of these frames are known of.
pub(crate) fn any_error(frames: &[SensorFrame]) -> bool {
    frames
        .iter()
        .any(|frame| frame.pose_std.position_m != 0.0 || frame.pose_std.rotation_rad != 0.0)
}

impl Covariances {
    /// What these covariances and the errors of the poses make together, for a reading in its own
    /// axes: an orientation that is off by a small turn d tilts the reading f (gravity in it) by `f
    /// x d`, so that
    ///
    /// ```text
    /// C_force = C + v_a I + v_o (|f|^2 I - f f^T)      C_rate = C + v_w I + v_o (|w|^2 I - w w^T)      C_orientation = C + v_o I
    /// ```
    /// with the variances of acceleration, angular velocity and orientation. Where one is infinite,
    /// the covariance starts with -1: "no estimate" (sensor_msgs/Imu), and whoever reads it leaves
    /// the values out. Without errors everything stays as it is.
    #[must_use]
    #[inline(always)]
    pub fn with_motion(self, variance: &SampleVariance, reading: &ImuSample) -> Self {
        if *variance == SampleVariance::default() {
            return self;
        }
        let tilted = |base, own: f64, vector: &Vector3<f64>| {
            let turned = Matrix3::identity() * vector.norm_squared() - vector * vector.transpose();
            grown(
                base,
                &(Matrix3::identity() * own + turned * variance.orientation),
            )
        };
        let orientation = if self.orientation[0] < 0.0 {
            self.orientation
        } else {
            grown(
                self.orientation,
                &(Matrix3::identity() * variance.orientation),
            )
        };
        Self {
            orientation,
            angular_velocity: tilted(
                self.angular_velocity,
                variance.angular_velocity,
                &reading.angular_velocity,
            ),
            linear_acceleration: tilted(
                self.linear_acceleration,
                variance.acceleration,
                &reading.specific_force,
            ),
        }
    }
}

fn grown(base: [f64; 9], by: &Matrix3<f64>) -> [f64; 9] {
    // Without a branch an entry.
    let finite = |all, entry: &f64| all & entry.is_finite();
    if by.iter().fold(true, finite) {
        return std::array::from_fn(|i| base[i] + by[(i / 3, i % 3)]);
    }
    let mut none = [0.0; 9];
    none[0] = -1.0;
    none
}

#[cfg(test)]
#[path = "uncertainty_tests.rs"]
mod tests;
