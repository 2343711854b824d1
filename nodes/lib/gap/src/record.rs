//! What is diagnosed: the poses and the readings of one placement.

use cromosim_imu::Reading;
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

/// One placement of a recording.
#[derive(Clone, Debug, Default)]
pub struct PlacementRecord {
    /// Name.
    pub name: String,
    /// Where the segment's mount frame was.
    pub reference: PoseSeries,
    /// What the IMU read.
    pub imu: ImuSeries,
}

/// Poses in the world (z up), in the order of time.
#[derive(Clone, Debug, Default)]
pub struct PoseSeries {
    /// When.
    pub stamps: Vec<Stamp>,
    /// m.
    pub positions: Vec<Vector3<f64>>,
    /// world_from_segment.
    pub rotations: Vec<UnitQuaternion<f64>>,
}

/// Readings in the order of their messages.
#[derive(Clone, Debug, Default)]
pub struct ImuSeries {
    /// By the IMU's clock.
    pub stamps: Vec<Stamp>,
    /// Specific force [m/s2] and angular velocity [rad/s], in the device's units.
    pub readings: Vec<Reading>,
    /// Declared standard deviation of the white noise per sample: accelerometer, gyroscope; none
    /// where the covariance is zero.
    pub declared: [Option<f64>; 2],
}
