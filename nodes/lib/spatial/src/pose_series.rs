//! Poses as a source reports them.

use nalgebra::{UnitQuaternion, Vector3};

use crate::Stamp;

/// Poses of a segment's mount frame in the world (z up), in the order of time; all lists have the same
/// length.
#[derive(Clone, Debug, Default)]
pub struct PoseSeries {
    /// By the reference's clock.
    pub stamps: Vec<Stamp>,
    /// Origin of the frame in the world, m.
    pub positions: Vec<Vector3<f64>>,
    /// `world_from_segment`.
    pub rotations: Vec<UnitQuaternion<f64>>,
}

impl PoseSeries {
    /// Seconds since the first pose.
    pub(crate) fn seconds(&self) -> Vec<f64> {
        let first = self.stamps.first().copied().unwrap_or_default();
        self.stamps.iter().map(|stamp| *stamp - first).collect()
    }
}
