//! Where a clip's joints are.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::clip::{BvhClip, Channel};

/// A clip's skeleton in one posture.
#[derive(Clone, Debug, PartialEq)]
pub struct SkeletonPose {
    /// The joints' frames in the file's world, file units.
    pub world_from_joint: Vec<Isometry3<f64>>,
    /// The bones' tips in the file's world, where the file has an end site.
    pub tips: Vec<Option<Vector3<f64>>>,
}

impl BvhClip {
    /// The joints' frames of one frame, in the file's axes and units: `world_from_joint =
    /// world_from_parent * parent_from_joint`. `index` is clamped to the last frame.
    pub fn world_from_joints(&self, index: usize) -> Vec<Isometry3<f64>> {
        let mut values = self.frame(index.min(self.frame_count() - 1)).iter();
        let mut world_from_joint: Vec<Isometry3<f64>> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let mut position = joint.rest_in_parent;
            let mut rotation = UnitQuaternion::identity();
            for (channel, &value) in joint.channels.iter().zip(&mut values) {
                match *channel {
                    Channel::Position(axis) => position[axis] = value,
                    Channel::Rotation(axis) => rotation *= about(axis, value.to_radians()),
                }
            }
            let parent_from_joint = Isometry3::from_parts(Translation3::from(position), rotation);
            world_from_joint.push(joint.parent.map_or(parent_from_joint, |parent| {
                world_from_joint[parent] * parent_from_joint
            }));
        }
        world_from_joint
    }

    /// The skeleton with all channels zero: every frame parallel to the file's axes.
    pub fn zero_pose(&self) -> SkeletonPose {
        let mut positions: Vec<Vector3<f64>> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            positions.push(joint.parent.map_or_else(Vector3::zeros, |parent| {
                positions[parent] + joint.rest_in_parent
            }));
        }
        self.with_tips(
            positions
                .into_iter()
                .map(|position| Isometry3::from(Translation3::from(position)))
                .collect(),
        )
    }

    /// The skeleton in one of the frames.
    pub fn pose_of_frame(&self, index: usize) -> SkeletonPose {
        self.with_tips(self.world_from_joints(index))
    }

    /// The skeleton with given rotations (world_from_joint, one a joint) and the bones of the rest.
    pub fn with_rotations(&self, rotations: &[UnitQuaternion<f64>]) -> SkeletonPose {
        let mut frames: Vec<Isometry3<f64>> = Vec::with_capacity(self.joints.len());
        for (joint, &rotation) in self.joints.iter().zip(rotations) {
            let position = joint.parent.map_or_else(Vector3::zeros, |parent| {
                frames[parent].rotation * joint.rest_in_parent + frames[parent].translation.vector
            });
            frames.push(Isometry3::from_parts(
                Translation3::from(position),
                rotation,
            ));
        }
        self.with_tips(frames)
    }

    fn with_tips(&self, world_from_joint: Vec<Isometry3<f64>>) -> SkeletonPose {
        let tips = self.joints.iter().zip(&world_from_joint);
        let tips = tips
            .map(|(joint, frame)| {
                joint
                    .tip
                    .map(|tip| frame.rotation * tip + frame.translation.vector)
            })
            .collect();
        SkeletonPose {
            world_from_joint,
            tips,
        }
    }
}

fn about(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(
        &[Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()][axis],
        angle,
    )
}
