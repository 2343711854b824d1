//! VIBE: a dictionary of people, each with `pose` (N, 72) in a camera's axes, `betas` (N, 10) and
//! `frame_ids`. Its camera is that of a crop: it tells no place, so the motion stays in place.

use cromosim_arrays::Entry;
use cromosim_body::ShapeSpace;

use super::track::{PoseAxes, PoseTrack};
use super::values::{
    Budget, betas, check_angles, frame_count, frame_ids, gender, numbers,
    rotations_from_axis_angles,
};
use crate::MotionError;

pub(super) fn track(person: &Entry, budget: &mut Budget) -> Result<PoseTrack, MotionError> {
    in_camera(person, budget, "pose")
}

/// A person whose pose stands under `key`, without a place.
pub(super) fn in_camera(
    person: &Entry,
    budget: &mut Budget,
    key: &str,
) -> Result<PoseTrack, MotionError> {
    let pose = person.at(key)?;
    let count = frame_count(&pose);
    budget.take(pose.key(), count)?;
    let rows = numbers(&pose, &[None, Some(72)], "(N, 72)")?;
    check_angles(&pose, &rows.values, 72, 0..=23)?;
    Ok(PoseTrack {
        person: person.key().to_owned(),
        gender: gender(person.get("gender").as_ref()),
        shape_space: ShapeSpace::Smpl,
        betas: betas(person.get("betas").as_ref(), count)?,
        frame_ids: frame_ids(person.get("frame_ids").as_ref(), count)?,
        rotations: rotations_from_axis_angles(&rows.values, 72, 24),
        trans: None,
        pelvis_turns: None,
        axes: PoseAxes::Camera,
        rate_hz: None,
        confidence: None,
    })
}
