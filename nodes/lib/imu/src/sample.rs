//! What a sensor reads, and the motion behind it.

use cromosim_spatial::{KinematicTrack, Stamp};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::{Bandwidth, Reading, SampleVariance};

/// Standard gravity, m/s2 (CGPM 1901).
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// Gravity in the world (z up), m/s2.
pub const GRAVITY_IN_WORLD: Vector3<f64> = Vector3::new(0.0, 0.0, -STANDARD_GRAVITY);

/// How a sensor moves at one time, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KinematicSample {
    /// When.
    pub stamp: Stamp,
    /// The sensor's frame, m.
    pub world_from_sensor: Isometry3<f64>,
    /// Of the frame's origin, m/s2; zero at rest.
    pub acceleration_in_world: Vector3<f64>,
    /// Of the frame against the world, rad/s.
    pub angular_velocity_in_world: Vector3<f64>,
    /// Its derivative, rad/s2; none from schemes that do not give it.
    pub angular_acceleration_in_world: Option<Vector3<f64>>,
    /// What errors of the poses leave in it.
    pub variance: SampleVariance,
    /// Up to which frequency it resolves the motion; none from schemes that do not smooth.
    pub bandwidth: Option<Bandwidth>,
}

/// One reading of an IMU, in sensor axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// When.
    pub stamp: Stamp,
    /// Orientation of the sensor.
    pub world_from_sensor: UnitQuaternion<f64>,
    /// Specific force: acceleration less gravity, m/s2; +9.80665 along "up" at rest.
    pub specific_force: Vector3<f64>,
    /// Against the world, rad/s.
    pub angular_velocity: Vector3<f64>,
}

impl ImuSample {
    /// Without stamp and orientation.
    pub fn reading(&self) -> Reading {
        Reading {
            specific_force: self.specific_force,
            angular_velocity: self.angular_velocity,
        }
    }
}

impl KinematicSample {
    /// What an error-free sensor reads: `a_S = R_SB^-1 R_BG^-1 (a_G - g)` and `w_S = R_SB^-1
    /// R_BG^-1 w_G`.
    pub fn imu(&self) -> ImuSample {
        // world_from_sensor = world_from_site * site_from_sensor, so its inverse is R_SB^-1
        // R_BG^-1.
        let sensor_from_world = self.world_from_sensor.rotation.inverse();
        ImuSample {
            stamp: self.stamp,
            world_from_sensor: self.world_from_sensor.rotation,
            specific_force: sensor_from_world * (self.acceleration_in_world - GRAVITY_IN_WORLD),
            angular_velocity: sensor_from_world * self.angular_velocity_in_world,
        }
    }
}

/// A motion on a grid of `rate_hz`, in the sensor's own axes: what a
/// [`crate::SensorModel`] starts from. Where a sample has no angular acceleration, the difference of
/// its neighbours' angular velocities stands for it.
pub fn track_in_sensor_axes(motion: &[KinematicSample], rate_hz: f64) -> KinematicTrack {
    let mut track = KinematicTrack {
        start: motion.first().map(|first| first.stamp).unwrap_or_default(),
        rate_hz,
        ..KinematicTrack::default()
    };
    for (k, sample) in motion.iter().enumerate() {
        let world_from_sensor = sample.world_from_sensor.rotation;
        let in_sensor = |vector: &Vector3<f64>| world_from_sensor.inverse_transform_vector(vector);
        let difference = || {
            let before = &motion[k.saturating_sub(1)];
            let after = &motion[(k + 1).min(motion.len() - 1)];
            (after.angular_velocity_in_world - before.angular_velocity_in_world)
                / (after.stamp - before.stamp).max(1e-9)
        };
        let angular_acceleration_in_world = sample
            .angular_acceleration_in_world
            .unwrap_or_else(difference);
        track.world_from_segment.push(world_from_sensor);
        track
            .acceleration_in_segment
            .push(in_sensor(&sample.acceleration_in_world));
        track
            .angular_velocity_in_segment
            .push(in_sensor(&sample.angular_velocity_in_world));
        track
            .angular_acceleration_in_segment
            .push(in_sensor(&angular_acceleration_in_world));
    }
    track
}
