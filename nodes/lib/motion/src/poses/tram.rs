//! TRAM: one person a file, `pred_rotmat` (N, 24, 3, 3), `pred_trans` (N, 1, 3) and `pred_shape`
//! (N, 10) in the camera's axes, `frame` (N); the camera's file has `world_cam_R` (T, 3, 3) and
//! `world_cam_T` (T, 3), world_from_camera of each frame of the video.

use cromosim_arrays::Entry;
use cromosim_body::ShapeSpace;
use nalgebra::{UnitQuaternion, Vector3};

use super::format::{MAX_POSES, PoseView};
use super::track::{PoseAxes, PoseTrack};
use super::values::{
    Budget, betas, frame_count, frame_ids, in_frames, numbers, rotations_from_matrices, vectors,
    wrong,
};
use crate::MotionError;

/// Frames of the longest camera track.
const MAX_CAMERAS: usize = MAX_POSES;

pub(super) fn track(
    root: &Entry,
    camera: Option<&Entry>,
    view: PoseView,
    budget: &mut Budget,
) -> Result<PoseTrack, MotionError> {
    let matrices = root.at("pred_rotmat")?;
    let count = frame_count(&matrices);
    budget.take(matrices.key(), count)?;
    let values = numbers(
        &matrices,
        &[None, Some(24), Some(3), Some(3)],
        "(N, 24, 3, 3)",
    )?;
    let track = PoseTrack {
        person: "0".to_owned(),
        gender: None,
        shape_space: ShapeSpace::Smpl,
        betas: betas(root.get("pred_shape").as_ref(), count)?,
        frame_ids: frame_ids(root.get("frame").as_ref(), count)?,
        rotations: in_frames(&rotations_from_matrices(&matrices, &values.values)?),
        trans: None,
        pelvis_turns: None,
        axes: PoseAxes::Camera,
        rate_hz: None,
        confidence: None,
    };
    match camera {
        Some(camera) if view == PoseView::World => in_world(track, root, camera),
        _ => Ok(track),
    }
}

fn in_world(mut track: PoseTrack, root: &Entry, camera: &Entry) -> Result<PoseTrack, MotionError> {
    let turns = camera.at("world_cam_R")?;
    let cameras = frame_count(&turns);
    if cameras > MAX_CAMERAS {
        return Err(wrong(
            &turns,
            format!("{cameras} frames, expected at most {MAX_CAMERAS}"),
        ));
    }
    let values = numbers(&turns, &[None, Some(3), Some(3)], "(T, 3, 3)")?;
    let rotations = rotations_from_matrices(&turns, &values.values)?;
    let positions = vectors(&camera.at("world_cam_T")?, cameras)?;
    let trans_in_camera = vectors(&root.at("pred_trans")?, track.rotations.len())?;
    let (mut trans, mut pelvis_turns) = (
        Vec::with_capacity(trans_in_camera.len()),
        Vec::with_capacity(trans_in_camera.len()),
    );
    for (frame, (rotations_of_joints, trans_in_camera)) in
        track.rotations.iter_mut().zip(trans_in_camera).enumerate()
    {
        let id = track
            .frame_ids
            .as_ref()
            .and_then(|ids| ids.get(frame).copied())
            .unwrap_or(frame as i64);
        let found: Option<(&UnitQuaternion<f64>, &Vector3<f64>)> = usize::try_from(id)
            .ok()
            .and_then(|id| Some((rotations.get(id)?, positions.get(id)?)));
        let Some((world_from_camera, position)) = found else {
            return Err(wrong(
                &turns,
                format!(
                    "no camera for frame {id}: there are {cameras}; give the camera.npy of the same video"
                ),
            ));
        };
        rotations_of_joints[0] = world_from_camera * rotations_of_joints[0];
        trans.push(world_from_camera * trans_in_camera + position);
        pelvis_turns.push(*world_from_camera);
    }
    Ok(PoseTrack {
        trans: Some(trans),
        pelvis_turns: Some(pelvis_turns),
        axes: PoseAxes::Detect,
        ..track
    })
}
