//! A source's skeleton and how it is laid on SMPL's, and the poses that follow from it.

use cromosim_body::{BodyPose, JOINT_COUNT, Joint, ShapedBody};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::alignment::alignments;
use super::rest::Rest;
use super::segments;
use crate::BvhClip;
use crate::motion::continuous;
use crate::skeleton_map::BoundMap;

/// Everything about a source that does not change from frame to frame.
pub(super) struct Source<'a> {
    pub clip: &'a BvhClip,
    pub map: BoundMap,
    pub rest: Rest,
    /// Turns the file's up axis to z.
    pub world_from_file: UnitQuaternion<f64>,
    pub unit_scale_m: f64,
}

impl Source<'_> {
    /// All frames, over a floor of unknown height.
    pub fn frames(&self, shaped: &ShapedBody, leg_ratio: f64) -> Vec<BodyPose> {
        let alignments = alignments(&self.map, &self.rest, shaped.joints_in_model());
        let joints = shaped.joints_in_model();
        let pelvis_from_mid_hips =
            (joints[Joint::LeftHip.index()] + joints[Joint::RightHip.index()]) / 2.0
                - joints[Joint::Pelvis.index()];
        // Constant in all frames: from the source joint's frame to SMPL's segment.
        let joint_from_segment: [Option<(usize, UnitQuaternion<f64>)>; JOINT_COUNT] =
            std::array::from_fn(|segment| {
                self.map.joints[segment].map(|joint| {
                    (
                        joint,
                        self.rest.body_from_joint[joint].inverse() * alignments[segment],
                    )
                })
            });
        let pose = |index: usize| {
            let file_from_joint = self.clip.world_from_joints(index);
            let world_from_segment = segments::complete(std::array::from_fn(|segment| {
                let (joint, joint_from_segment) = joint_from_segment[segment]?;
                Some(self.world_from_file * file_from_joint[joint].rotation * joint_from_segment)
            }));
            let mid_hips = self.mid_hips(&file_from_joint) * (self.unit_scale_m * leg_ratio);
            BodyPose {
                root_position: self.world_from_file * mid_hips
                    - world_from_segment[0] * pelvis_from_mid_hips,
                local_rotations: segments::local_rotations(&world_from_segment),
            }
        };
        continuous((0..self.clip.frame_count()).map(pose).collect())
    }

    /// The middle between the hip joints, file units.
    fn mid_hips(&self, file_from_joint: &[Isometry3<f64>]) -> Vector3<f64> {
        let hip = |joint: Joint| {
            self.map.joints[joint.index()].map_or_else(Vector3::zeros, |hip| {
                file_from_joint[hip].translation.vector
            })
        };
        (hip(Joint::LeftHip) + hip(Joint::RightHip)) / 2.0
    }
}
