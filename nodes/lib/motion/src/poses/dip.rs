//! DIP-IMU (Huang et al. 2018): `gt` (N, 72), the reference poses in place at 60 Hz. What its
//! sensors measured is read by the crate `recording`.

use std::io::{Read, Seek};

use cromosim_arrays::{Array, Container};
use cromosim_body::ShapeSpace;

use super::track::{PoseAxes, PoseTrack};
use super::values::{Budget, check_angles, frame_count, numbers, rotations_from_axis_angles};
use crate::MotionError;

/// Frames per second of DIP-IMU's arrays, Hz.
const DIP_RATE_HZ: f64 = 60.0;

pub(super) fn track<R: Read + Seek>(
    container: &mut Container<R>,
    budget: &mut Budget,
) -> Result<PoseTrack, MotionError> {
    let pose = container.at("gt")?;
    budget.take(pose.key(), frame_count(&pose))?;
    let rows = numbers(&pose, &[None, Some(72)], "(N, 72)")?;
    check_angles(&pose, &rows.values, 72, 0..=23)?;
    Ok(PoseTrack {
        person: "0".to_owned(),
        gender: None,
        shape_space: ShapeSpace::Smpl,
        betas: Array {
            shape: vec![1, 0],
            values: Vec::new(),
        },
        frame_ids: None,
        rotations: rotations_from_axis_angles(&rows.values, 72, 24),
        trans: None,
        pelvis_turns: None,
        axes: PoseAxes::Detect,
        rate_hz: Some(DIP_RATE_HZ),
        confidence: None,
    })
}
