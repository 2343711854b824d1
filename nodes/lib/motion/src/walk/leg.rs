//! A leg between a hip and an ankle.

use nalgebra::{UnitQuaternion, Vector3};

use crate::axes::frame_of;

/// Bones of a leg at rest, model axes (x left, y up, z forward), m.
#[derive(Clone, Copy, Debug)]
pub(super) struct LegBones {
    pub thigh: Vector3<f64>,
    pub shin: Vector3<f64>,
}

impl LegBones {
    /// Rotation of thigh and shin in the world so that the ankle stands `hip_to_ankle` from the
    /// hip, the knee bends about the segment's x axis only, and that axis points as nearly along
    /// `hinge` as can be. A target out of reach is approached as far as the leg goes.
    pub fn reach(
        &self,
        hip_to_ankle: Vector3<f64>,
        hinge: Vector3<f64>,
    ) -> [UnitQuaternion<f64>; 2] {
        let flexion = self.flexion(hip_to_ankle.norm());
        let thigh_from_shin = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), flexion);
        let in_thigh = self.thigh + thigh_from_shin * self.shin;
        let world_from_thigh =
            frame_of(hip_to_ankle, hinge) * frame_of(in_thigh, Vector3::x()).inverse();
        [world_from_thigh, world_from_thigh * thigh_from_shin]
    }

    /// The knee's angle for a distance between hip and ankle: |thigh + Rx(angle) shin| = distance,
    /// that is c cos + s sin = k.
    pub fn flexion(&self, distance: f64) -> f64 {
        let (a, b) = (self.thigh, self.shin);
        let (c, s) = (a.y * b.y + a.z * b.z, a.z * b.y - a.y * b.z);
        let k = (distance * distance - a.norm_squared() - b.norm_squared()) / 2.0 - a.x * b.x;
        s.atan2(c) + (k / c.hypot(s)).clamp(-1.0, 1.0).acos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ankle_gets_where_it_should() {
        let leg = LegBones {
            thigh: Vector3::new(0.023, -0.4122, 0.002),
            shin: Vector3::new(0.004, -0.4233, -0.01),
        };
        let target = Vector3::new(0.3, 0.05, -0.7);
        let [thigh, shin] = leg.reach(target, Vector3::y());
        assert!((thigh * leg.thigh + shin * leg.shin - target).norm() < 1e-12);
        assert!(
            (thigh.inverse() * shin).scaled_axis().x > 0.1,
            "the knee bends forward"
        );
        assert!((thigh * Vector3::x()).dot(&Vector3::y()) > 0.98);
    }
}
