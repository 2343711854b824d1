//! Whether readings err as much as their covariances state.

use cromosim_imu::{Covariances, KinematicSample, Reading};
use nalgebra::{Matrix3, Vector3};

/// Means of `e^T C^-1 e / 3`, where e is a reading's error and C its covariance: 1 where they err as
/// much as is stated. Specific force, angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct StatedErrors {
    sums: [f64; 2],
    counts: [f64; 2],
}

impl StatedErrors {
    /// A reading of a device without errors of its own, whose covariances are those of the motion
    /// alone; left out where none is stated.
    pub fn add_reading(&mut self, sample: &KinematicSample, measured: &Reading) {
        let simulated = sample.imu();
        let stated = NONE.with_motion(&sample.variance, &simulated);
        let errors = [
            simulated.specific_force - measured.specific_force,
            simulated.angular_velocity - measured.angular_velocity,
        ];
        let covariances = [stated.linear_acceleration, stated.angular_velocity];
        for (channel, (error, covariance)) in errors.iter().zip(covariances).enumerate() {
            if let Some(square) = square(error, &covariance) {
                self.sums[channel] += square;
                self.counts[channel] += 1.0;
            }
        }
    }

    /// Adds those of other recordings.
    pub fn add(&mut self, other: &Self) {
        for channel in 0..2 {
            self.sums[channel] += other.sums[channel];
            self.counts[channel] += other.counts[channel];
        }
    }

    /// Specific force and angular velocity; NaN where nothing was stated.
    pub fn means(&self) -> [f64; 2] {
        [0, 1].map(|channel| self.sums[channel] / self.counts[channel])
    }
}

/// Standard deviations that a reading's covariances state of the norms of specific force, m/s2, and
/// angular velocity, rad/s: `sqrt(u^T C u)` along the reading u; none where none is stated.
pub(super) fn stated_of_norms(sample: &KinematicSample) -> [Option<f64>; 2] {
    let simulated = sample.imu();
    let stated = NONE.with_motion(&sample.variance, &simulated);
    let along = |reading: Vector3<f64>, covariance: [f64; 9]| {
        if covariance[0] <= 0.0 {
            return None;
        }
        let unit = reading.try_normalize(0.0).unwrap_or_else(Vector3::z);
        let variance = unit.dot(&(Matrix3::from_row_slice(&covariance) * unit));
        Some(variance.sqrt())
    };
    [
        along(simulated.specific_force, stated.linear_acceleration),
        along(simulated.angular_velocity, stated.angular_velocity),
    ]
}

const NONE: Covariances = Covariances {
    orientation: [0.0; 9],
    angular_velocity: [0.0; 9],
    linear_acceleration: [0.0; 9],
};

/// `e^T C^-1 e / 3`; none for covariances that are unknown (all zero) or not reported (-1).
fn square(error: &Vector3<f64>, covariance: &[f64; 9]) -> Option<f64> {
    if covariance[0] <= 0.0 {
        return None;
    }
    let inverse = Matrix3::from_row_slice(covariance).try_inverse()?;
    Some(error.dot(&(inverse * error)) / 3.0)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn squares_are_weighed_by_the_covariance() {
        let covariance = [4.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.25];
        let error = Vector3::new(2.0, 1.0, 0.5);
        assert!((square(&error, &covariance).unwrap() - 1.0).abs() < 1e-12);
        assert!(square(&error, &[0.0; 9]).is_none());
        assert!(square(&error, &[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).is_none());
    }
}
