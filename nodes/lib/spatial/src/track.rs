//! A motion's kinematics on a uniform grid of time.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::Stamp;

/// Kinematics of a segment's frame on a uniform grid, in the segment's own axes: what an IMU model
/// starts from.
///
/// All vectors have the same length; entry k belongs to `start + k / rate_hz`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KinematicTrack {
    /// Time of the first entry.
    pub start: Stamp,
    /// Entries per second.
    pub rate_hz: f64,
    /// Orientation of the segment.
    pub world_from_segment: Vec<UnitQuaternion<f64>>,
    /// `R^T a`: acceleration of the origin against the world, in segment axes, m/s2; zero at rest.
    pub acceleration_in_segment: Vec<Vector3<f64>>,
    /// `w`: against the world, in segment axes, rad/s.
    pub angular_velocity_in_segment: Vec<Vector3<f64>>,
    /// `dw/dt`, in segment axes, rad/s2.
    pub angular_acceleration_in_segment: Vec<Vector3<f64>>,
}

impl KinematicTrack {
    /// Number of entries.
    pub fn len(&self) -> usize {
        self.world_from_segment.len()
    }

    /// Whether the track has no entry.
    pub fn is_empty(&self) -> bool {
        self.world_from_segment.is_empty()
    }

    /// The orientation's quaternion at a time, straight between entries and held at the ends; of one sign where the
    /// entries' are.
    pub fn quaternion_at(&self, stamp: Stamp) -> Quaternion<f64> {
        let Some(last) = self.len().checked_sub(1) else {
            return Quaternion::identity();
        };
        let position = ((stamp - self.start) * self.rate_hz).clamp(0.0, last as f64);
        let before = (position as usize).min(last.saturating_sub(1));
        let share = position - before as f64;
        let of = |index: usize| self.world_from_segment[index.min(last)].into_inner();
        (of(before) * (1.0 - share) + of(before + 1) * share).normalize()
    }

    /// Time of entry `index`.
    pub fn stamp(&self, index: usize) -> Stamp {
        Stamp::from_nanos(self.start.nanos + (index as f64 * 1e9 / self.rate_hz).round() as i64)
    }
}
