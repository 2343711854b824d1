//! What is diagnosed: the poses and the readings of one placement.

use cromosim_imu::{PerChannel, Reading};
pub use cromosim_spatial::PoseSeries;
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use crate::diagnosis::ClockJump;

/// One placement of a recording.
#[derive(Clone, Debug, Default)]
pub struct PlacementRecord {
    /// Name, as in the topics `/imu/NAME/data_raw`.
    pub name: String,
    /// Where the segment's mount frame was.
    pub reference: PoseSeries,
    /// What the IMU read.
    pub imu: MeasuredImu,
    /// Where the reference's clock was set back over time that it had been through: these poses are
    /// left out of `reference`.
    pub set_back: Vec<ClockJump>,
    /// What its magnetometer read; empty where it has none.
    pub field: MeasuredField,
}

/// What a real magnetometer sent; both lists have the same length.
#[derive(Clone, Debug, Default)]
pub struct MeasuredField {
    /// By the IMU's clock.
    pub stamps: Vec<Stamp>,
    /// T, in the sensor's axes.
    pub readings: Vec<Vector3<f64>>,
}

/// What a real IMU sent, in the order of its messages; both lists have the same length.
#[derive(Clone, Debug, Default)]
pub struct MeasuredImu {
    /// By the IMU's clock.
    pub stamps: Vec<Stamp>,
    /// Specific force [m/s2] and angular velocity [rad/s], in the device's units.
    pub readings: Vec<Reading>,
    /// Declared standard deviation of the white noise per sample, m/s2 and rad/s or the device's
    /// units; none where the covariance does not tell.
    pub declared: PerChannel<Option<f64>>,
}
