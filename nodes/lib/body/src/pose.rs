//! Where a body is and how its joints are turned.

use nalgebra::{UnitQuaternion, Vector3};

use crate::{JOINT_COUNT, Joint};

/// One frame of a body's motion.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyPose {
    /// The pelvis joint in the world, m. SMPL's `trans` is this less the rest pelvis J_0(beta).
    pub root_position: Vector3<f64>,
    /// `[0]` is world_from_pelvis, every other one is parent_from_joint, in SMPL's order.
    pub local_rotations: [UnitQuaternion<f64>; JOINT_COUNT],
}

impl BodyPose {
    /// The T-pose with the world's axes parallel to the model's: in a world with z up such a body
    /// lies on its back.
    pub fn rest(root_position: Vector3<f64>) -> Self {
        Self {
            root_position,
            local_rotations: [UnitQuaternion::identity(); JOINT_COUNT],
        }
    }

    /// From SMPL's `pose` (24, 3): axis times angle (rad) of each joint.
    pub fn from_axis_angles(
        root_position: Vector3<f64>,
        axis_angles: &[Vector3<f64>; JOINT_COUNT],
    ) -> Self {
        Self {
            root_position,
            local_rotations: axis_angles.map(UnitQuaternion::from_scaled_axis),
        }
    }

    /// SMPL's `pose` (24, 3): axis times angle (rad) of each joint, angles in [0, pi].
    pub fn axis_angles(&self) -> [Vector3<f64>; JOINT_COUNT] {
        self.local_rotations.map(|rotation| rotation.scaled_axis())
    }

    /// world_from_segment's rotation of every segment: the product of the local rotations from the
    /// pelvis on.
    pub fn world_rotations(&self) -> [UnitQuaternion<f64>; JOINT_COUNT] {
        let mut world_from = self.local_rotations;
        for joint in Joint::ALL {
            if let Some(parent) = joint.parent() {
                world_from[joint.index()] =
                    world_from[parent.index()] * self.local_rotations[joint.index()];
            }
        }
        world_from
    }
}
