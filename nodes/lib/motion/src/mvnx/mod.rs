//! MVNX: a recording of Xsens MVN as XML.
//!
//! The element `subject` has the frame rate, `segments` and `sensors` the labels, a `frame` of type
//! `normal` is a sample: lists of numbers, by segment or by sensor. `orientation` is
//! world_from_segment (w x y z) and `position` the segment's origin (m), both in a world with x
//! forward or north, y left or west, z up; the segments' axes are the world's in a T-pose that
//! faces x. `sensorOrientation` is world_from_sensor, `sensorFreeAcceleration` (m/s2) in world axes
//! and without gravity, `angularVelocity` (rad/s) the segment's in world axes. Frames of other
//! types (`identity`, `tpose`) are poses of a calibration.
//!
//! The file is walked through by quick-xml, an element at a time: hundreds of megabytes are usual.

mod clip;
mod parse;

use nalgebra::{UnitQuaternion, Vector3};

pub use parse::parse_mvnx;

/// A recording: at least one segment and one frame. Lists of frames are frame-major; those that the
/// file does not have are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mvnx {
    /// The file's name.
    pub name: String,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// When it began, ms since 1970, where the file says it.
    pub start_ms: Option<i64>,
    /// Labels.
    pub segments: Vec<String>,
    /// Labels.
    pub sensors: Vec<String>,
    /// Numbers of the frames as the file counts them, rising.
    pub frames: Vec<u32>,
    /// world_from_segment; (frames, segments).
    pub orientations: Vec<UnitQuaternion<f64>>,
    /// The segments' origins in the world, m; (frames, segments).
    pub positions: Vec<Vector3<f64>>,
    /// The segments' in world axes, rad/s; (frames, segments), or empty.
    pub angular_velocities: Vec<Vector3<f64>>,
    /// world_from_sensor; (frames, sensors), or empty.
    pub sensor_orientations: Vec<UnitQuaternion<f64>>,
    /// In world axes, without gravity, m/s2; (frames, sensors), or empty.
    pub sensor_free_accelerations: Vec<Vector3<f64>>,
}

/// Whether a text begins like an MVNX file.
pub(crate) fn is_mvnx(start: &str) -> bool {
    start.starts_with('<') && start.contains("<mvnx")
}
