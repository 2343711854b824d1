//! Seeded noise, and the covariances that messages state.

use cromosim_spatial::{SpatialError, so3};
use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha12Rng;

use crate::random::{normal_pair, stream};
use crate::stated_errors::StatedErrors;
use crate::{DeclaredNoise, Device, ImuError, PerChannel, Reading};

/// Covariances of a sensor_msgs/Imu, row-major 3x3, as REP-145 reads them: all zero is unknown, -1
/// first is "not reported".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariances {
    /// rad2.
    pub orientation: [f64; 9],
    /// (rad/s)2.
    pub angular_velocity: [f64; 9],
    /// (m/s2)2.
    pub linear_acceleration: [f64; 9],
}

impl Covariances {
    /// Those of a device read at a rate: on the diagonals the variance per sample of its white noise
    /// (density^2 rate), its rounding (step^2 / 12) and what stays unexplained, in the units that it
    /// reports; a device without any has unknown (zero) covariances. The orientation is reported
    /// (`data`).
    pub fn for_device(device: &Device, rate_hz: f64) -> Self {
        Self {
            orientation: diagonal(device.orientation_stddev().powi(2)),
            ..Self::white(StatedErrors::of_device(device, rate_hz).own)
        }
    }

    /// Of independent axes with these variances, (m/s2)2 and (rad/s)2; the orientation's are unknown.
    pub fn white(variances: PerChannel<f64>) -> Self {
        Self {
            orientation: [0.0; 9],
            angular_velocity: diagonal(variances.gyroscope),
            linear_acceleration: diagonal(variances.accelerometer),
        }
    }

    /// The same without orientation (`data_raw`): its covariance starts with -1.
    #[must_use]
    pub fn without_orientation(self) -> Self {
        let mut orientation = [0.0; 9];
        orientation[0] = -1.0;
        Self {
            orientation,
            ..self
        }
    }
}

fn diagonal(variance: f64) -> [f64; 9] {
    [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]
}

/// White noise for readings, one after the other.
///
/// Noise per sample: sigma = density sqrt(rate), independent per axis. Each channel of each
/// placement has its own ChaCha stream, derived from seed, placement name and channel alone: the
/// same bytes come out whatever else is simulated, in whatever order, on however many threads.
#[derive(Clone, Debug)]
pub struct NoiseSource {
    accelerometer: WhiteNoise,
    gyroscope: WhiteNoise,
    orientation: WhiteNoise,
}

/// Three axes with one standard deviation and one stream of numbers.
#[derive(Clone, Debug)]
struct WhiteNoise {
    sigma: f64,
    random: ChaCha12Rng,
}

impl NoiseSource {
    /// The source of one placement's readings at a rate, and of errors of its orientation with this
    /// standard deviation, rad. `placement` is the name that the numbers depend on.
    ///
    /// # Errors
    /// [`ImuError::Trajectory`] for a rate that is not positive.
    pub fn white(
        noise: &DeclaredNoise,
        orientation_stddev: f64,
        rate_hz: f64,
        seed: u64,
        placement: &str,
    ) -> Result<Self, ImuError> {
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return Err(SpatialError::BadRate { rate_hz }.into());
        }
        let root = rate_hz.sqrt();
        let channel = |number, sigma| WhiteNoise {
            sigma,
            random: stream(seed, placement, number),
        };
        Ok(Self {
            accelerometer: channel(0, noise.accel_density * root),
            gyroscope: channel(1, noise.gyro_density * root),
            orientation: channel(2, orientation_stddev),
        })
    }

    /// Adds the noise of the next readings, in order of time.
    pub fn add_to(&mut self, readings: &mut [Reading]) {
        for reading in readings {
            let drawn = self.draw();
            reading.specific_force += drawn.specific_force;
            reading.angular_velocity += drawn.angular_velocity;
        }
    }

    /// The noise of the next reading.
    pub fn draw(&mut self) -> Reading {
        Reading {
            specific_force: self.accelerometer.draw(),
            angular_velocity: self.gyroscope.draw(),
        }
    }

    /// The noise of the next orientation, in sensor axes.
    pub fn draw_turn(&mut self) -> UnitQuaternion<f64> {
        so3::exp(&self.orientation.draw())
    }
}

impl WhiteNoise {
    fn draw(&mut self) -> Vector3<f64> {
        let [x, y] = normal_pair(&mut self.random);
        let [z, _] = normal_pair(&mut self.random);
        Vector3::new(x, y, z) * self.sigma
    }
}

#[cfg(test)]
#[path = "noise_tests.rs"]
mod tests;
