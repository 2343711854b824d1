//! Whether readings err as much as their covariances state.

use cromosim_imu::{Covariances, KinematicSample, Reading};
use cromosim_learned::DeviceRanges;
use nalgebra::{Matrix3, Vector3};

/// Means of `e^T C^-1 e / 3`, where e is a reading's error and C its covariance: 1 where they err as
/// much as is stated. Specific force, angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct StatedErrors {
    sums: [f64; 2],
    counts: [f64; 2],
}

impl StatedErrors {
    /// A reading whose covariances are those of the motion and of the device that measured; left out
    /// where none is stated.
    pub fn add_reading(&mut self, sample: &KinematicSample, measured: &Reading, own: &OwnErrors) {
        let simulated = sample.imu();
        let stated = own
            .of(&simulated.reading())
            .with_motion(&sample.variance, &simulated);
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

/// What a device that measured adds of its own. That of known motion errs in nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OwnErrors {
    /// Standard deviation of each axis' gain, and of what it takes of another axis.
    gain: f64,
    cross_axis: f64,
    /// Of white noise, (m/s2)^2 and (rad/s)^2.
    noise: [f64; 2],
}

impl OwnErrors {
    /// Of a device of which no more is known than what data sheets of such devices allow (and trainings
    /// draw). Its biases are fitted, and left out.
    pub fn of_any_device(rate_hz: f64) -> Self {
        let allowed = DeviceRanges::default();
        // The mean square of a uniform draw.
        let noise = |[a, b]: [f64; 2]| (a * a + a * b + b * b) / 3.0 * rate_hz;
        Self {
            gain: allowed.scale,
            cross_axis: allowed.misalignment,
            noise: [noise(allowed.accel_noise), noise(allowed.gyro_noise)],
        }
    }

    /// Covariances of a reading's errors.
    fn of(&self, reading: &Reading) -> Covariances {
        let diagonal = |vector: &Vector3<f64>, noise: f64| {
            let mut covariance = [0.0; 9];
            for axis in 0..3 {
                let square = vector[axis].powi(2);
                covariance[4 * axis] = noise
                    + self.gain.powi(2) * square
                    + self.cross_axis.powi(2) * (vector.norm_squared() - square);
            }
            covariance
        };
        Covariances {
            orientation: [0.0; 9],
            angular_velocity: diagonal(&reading.angular_velocity, self.noise[1]),
            linear_acceleration: diagonal(&reading.specific_force, self.noise[0]),
        }
    }
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
    fn a_device_errs_in_its_gains_and_axes() {
        let reading = Reading {
            specific_force: Vector3::new(0.0, 0.0, 10.0),
            angular_velocity: Vector3::zeros(),
        };
        let found = OwnErrors::of_any_device(100.0).of(&reading);
        let deviation = |axis: usize| found.linear_acceleration[4 * axis].sqrt();
        assert!((deviation(2) - 0.1034).abs() < 1e-3 && (deviation(0) - 0.0565).abs() < 1e-3);
        assert_eq!(
            OwnErrors::default().of(&reading).linear_acceleration,
            [0.0; 9]
        );
    }

    #[test]
    fn squares_are_weighed_by_the_covariance() {
        let covariance = [4.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.25];
        let error = Vector3::new(2.0, 1.0, 0.5);
        assert!((square(&error, &covariance).unwrap() - 1.0).abs() < 1e-12);
        assert!(square(&error, &[0.0; 9]).is_none());
        assert!(square(&error, &[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).is_none());
    }
}
