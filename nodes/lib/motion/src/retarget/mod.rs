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
mod source;
mod stance;

use std::sync::Arc;

use cromosim_body::{BodyModel, Gender, Joint, ShapeFit, ShapedBody};
use nalgebra::Vector3;

use crate::axes::{axis_name, minimal_rotation};
use crate::motion::check_finite;
use crate::poses::skeleton_betas;
use crate::{BvhClip, MotionError, MotionOptions, RetargetReport, SkeletonMap, SmplMotion};
use source::Source;

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
    let report = RetargetReport {
        up_axis: axis_name(up_in_file),
        source_height_m,
        leg_ratio,
        frames_left_out,
        betas: betas.clone(),
        bone_length_rms_m,
        floor_shift_m,
        ..errors::report(&source, &shaped, &frames, frames_left_out)
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
