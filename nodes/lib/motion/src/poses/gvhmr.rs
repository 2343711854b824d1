//! GVHMR: `smpl_params_global` with `global_orient` (N, 3), `body_pose` (N, 63), `transl` (N, 3)
//! and `betas` of SMPL-X, in a world with y up; `smpl_params_incam` is the same in the camera's
//! axes.

use cromosim_arrays::Entry;
use cromosim_body::ShapeSpace;
use nalgebra::Vector3;

use super::format::PoseView;
use super::track::{PoseAxes, PoseTrack};
use super::values::{
    Budget, betas, body_angles, check_angles, frame_count, numbers, rotations_from_root_and_body,
    vectors,
};
use crate::MotionError;

pub(super) fn track(
    root: &Entry,
    view: PoseView,
    budget: &mut Budget,
) -> Result<PoseTrack, MotionError> {
    let parameters = root.at(if view == PoseView::Camera {
        "smpl_params_incam"
    } else {
        "smpl_params_global"
    })?;
    let orient = parameters.at("global_orient")?;
    let count = frame_count(&orient);
    budget.take(orient.key(), count)?;
    let key = orient;
    let orient = numbers(&key, &[None, Some(3)], "(N, 3)")?;
    check_angles(&key, &orient.values, 3, 0..=0)?;
    let body = body_angles(&parameters.at("body_pose")?, count)?;
    let (trans, axes) = match view {
        PoseView::Camera => (None, PoseAxes::Camera),
        PoseView::World => (
            Some(vectors(&parameters.at("transl")?, count)?),
            PoseAxes::Up(Vector3::y()),
        ),
    };
    Ok(PoseTrack {
        person: "0".to_owned(),
        gender: None,
        shape_space: ShapeSpace::SmplX,
        betas: betas(parameters.get("betas").as_ref(), count)?,
        frame_ids: None,
        rotations: rotations_from_root_and_body(&orient.values, &body.values),
        trans,
        pelvis_turns: None,
        axes,
        rate_hz: None,
        confidence: None,
    })
}
