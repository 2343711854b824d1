//! WHAM: a dictionary of people, each with `pose_world` (N, 72) and `trans_world` (N, 3) in a world
//! with y up, `pose` in the camera's axes, `betas` (N, 10) and `frame_ids`.

use cromosim_arrays::Entry;
use nalgebra::Vector3;

use super::format::PoseView;
use super::track::{PoseAxes, PoseTrack};
use super::values::{Budget, vectors};
use super::vibe::in_camera;
use crate::MotionError;

pub(super) fn track(
    person: &Entry,
    view: PoseView,
    budget: &mut Budget,
) -> Result<PoseTrack, MotionError> {
    if view == PoseView::Camera {
        return in_camera(person, budget, "pose");
    }
    let track = in_camera(person, budget, "pose_world")?;
    let trans = vectors(&person.at("trans_world")?, track.rotations.len())?;
    Ok(PoseTrack {
        trans: Some(trans),
        axes: PoseAxes::Up(Vector3::y()),
        ..track
    })
}
