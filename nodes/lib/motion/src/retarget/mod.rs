//! From a source's skeleton to SMPL's joints.
//!
//! In the rest pose (a T-pose or an A-pose) the source's segments are laid against SMPL's:
//! `body_from_joint` is a source joint's frame in the body's axes (x left, y up, z forward), and
//! `alignment` the rotation from SMPL's T-pose to the source's rest pose, bone on bone and with the
//! roll of the bone before it. Then, in every frame, `world_from_segment = world_from_file *
//! file_from_joint * joint_from_body * alignment`, so that bones keep their directions and rotation
//! about a bone stays rotation about that bone.

mod alignment;
mod errors;
pub(crate) mod floor;
mod lead_in;
mod rest;
pub(crate) mod scale;
mod segments;

use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose, Gender, JOINT_COUNT, Joint, ShapeFit, ShapedBody};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::axes::{axis_name, minimal_rotation};
use crate::motion::continuous;
use crate::poses::skeleton_betas;
use crate::skeleton_map::BoundMap;
use crate::{BvhClip, MotionError, MotionOptions, RetargetReport, SkeletonMap, SmplMotion};

/// Everything about a source that does not change from frame to frame.
struct Source<'a> {
    clip: &'a BvhClip,
    map: BoundMap,
    rest: rest::Rest,
    /// Turns the file's up axis to z.
    world_from_file: UnitQuaternion<f64>,
    unit_scale_m: f64,
}

/// Retargets a clip to `body`: rotations by bone directions and roll, shape by bone lengths, root
/// by leg length, feet on z = 0. `start_s` and `duration_s` of the options are for
/// [`SmplMotion::slice`] and not used here.
///
/// # Errors
/// [`MotionError`] where skeleton, rest pose, up axis or unit cannot be told; the message says
/// which option tells it.
pub fn retarget(
    clip: &BvhClip,
    body: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<SmplMotion, MotionError> {
    let map = match options.map()? {
        Some(map) => map.bind(clip)?,
        None => SkeletonMap::detect(clip)?,
    };
    let up_in_file = scale::up_axis(clip, &map, options.up_axis)?;
    let rest = rest::choose(clip, &map, options.rest, up_in_file)?;
    let (unit_scale_m, source_height_m) =
        scale::unit_scale(clip.name(), &map, &rest, body, options.unit_scale_m)?;
    let joint = |joint: Joint| rest.joint(&map, joint);
    let ShapeFit {
        betas,
        length_rms_m: bone_length_rms_m,
    } = skeleton_betas(clip.name(), options.shape, body, joint, unit_scale_m)?;
    let shaped = ShapedBody::new(body.clone(), &betas)?;
    let leg_ratio = scale::leg_length(&|joint| Some(shaped.joints_in_model()[joint.index()]))
        / (unit_scale_m * scale::leg_length(&|joint| rest.joint(&map, joint)));
    let source = Source {
        clip,
        map,
        rest,
        world_from_file: minimal_rotation(up_in_file, Vector3::z()),
        unit_scale_m,
    };
    let mut frames = source.frames(&shaped, leg_ratio);
    let frames_left_out = if options.keep_lead_in {
        0
    } else {
        lead_in::frames_to_leave_out(&source, &shaped, &frames)
    };
    frames.drain(..frames_left_out);
    let floor_shift_m = floor::stand_on_floor(&shaped, &mut frames, clip.rate_hz());
    check_finite(clip.name(), &frames)?;
    let directions = errors::bone_directions(&source, &shaped, &frames, frames_left_out);
    let report = RetargetReport {
        map: source.map.name.clone(),
        up_axis: axis_name(up_in_file),
        unit_scale_m,
        source_height_m,
        rest: source.rest.origin.to_string(),
        leg_ratio,
        frames_left_out,
        bone_direction_median_deg: directions.median_deg,
        bone_direction_max_deg: directions.max_deg,
        bones: directions.bones,
        betas: betas.clone(),
        bone_length_rms_m,
        floor_shift_m,
    };
    Ok(SmplMotion {
        name: clip.name().to_owned(),
        rate_hz: clip.rate_hz(),
        gender: body.gender().unwrap_or(Gender::Neutral),
        betas,
        shape_space: body.shape_space(),
        frames,
        confidence: None,
        report: Some(report),
        markers: None,
        poses: None,
    })
}

impl Source<'_> {
    /// All frames, over a floor of unknown height.
    fn frames(&self, shaped: &ShapedBody, leg_ratio: f64) -> Vec<BodyPose> {
        let alignments = alignment::alignments(&self.map, &self.rest, shaped.joints_in_model());
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

pub(crate) fn check_finite(name: &str, frames: &[BodyPose]) -> Result<(), MotionError> {
    for (frame, pose) in frames.iter().enumerate() {
        let not_finite = |what| MotionError::NotFinite {
            name: name.to_owned(),
            frame,
            what,
        };
        if !pose.root_position.iter().all(|value| value.is_finite()) {
            return Err(not_finite("the root position"));
        }
        if !pose
            .local_rotations
            .iter()
            .all(|rotation| rotation.coords.iter().all(|value| value.is_finite()))
        {
            return Err(not_finite("a rotation"));
        }
    }
    Ok(())
}
