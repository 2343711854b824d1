//! AMASS: `poses` (N, 156) and `mocap_framerate` of the first release, `mocap_frame_rate` and parts
//! of the pose since stage II (SMPL-X too), and MoSh++'s own pickles (`fullpose`,
//! `stageii_debug_details`). Axis times angle, world z up. Fingers, jaw and eyes are passed over.

use std::io::{Read, Seek};

use cromosim_arrays::{ArraysError, Container, Entry};
use cromosim_body::ShapeSpace;
use nalgebra::Vector3;

use super::track::{PoseAxes, PoseTrack, Rotations};
use super::values::{
    Budget, RATES_HZ, RATES_TEXT, SHARED_JOINTS, betas, body_angles, check_angles, frame_count,
    gender, numbers, rotations_from_axis_angles, rotations_from_root_and_body, vectors, wrong,
};
use crate::MotionError;

/// Where MoSh++'s pickles hold its settings as OmegaConf's objects, which are passed over: gender
/// and kind of body stand in them alone.
pub(super) const SKIPPED: &[&[&str]] =
    &[&["stageii_debug_details", "cfg"], &["stagei_debug_details"]];
/// Values in a row of `poses`: SMPL, its 22 shared joints alone, SMPL-H, SMPL-X.
const WIDTHS: [usize; 4] = [72, 66, 156, 165];

pub(super) fn tracks<R: Read + Seek>(
    container: &mut Container<R>,
    budget: &mut Budget,
) -> Result<Vec<PoseTrack>, MotionError> {
    let (rotations, width) = poses(container, budget)?;
    let count = rotations.len();
    let trans = vectors(&container.at("trans")?, count)?;
    let kind = container
        .get("surface_model_type")?
        .and_then(|entry| entry.text().ok());
    let shape_space = match kind.map(|kind| kind.to_ascii_lowercase()).as_deref() {
        // As our own writer marks the embedded body's.
        Some("cromosim") => ShapeSpace::Cromosim,
        Some("smplx") => ShapeSpace::SmplX,
        None if width == 165 => ShapeSpace::SmplX,
        _ => ShapeSpace::Smpl,
    };
    let details = container.get("stageii_debug_details")?;
    let in_details = |key: &str| details.as_ref().and_then(|details| details.get(key));
    let rate = match container.get("mocap_framerate")? {
        None => container
            .get("mocap_frame_rate")?
            .or_else(|| in_details("mocap_frame_rate")),
        rate => rate,
    };
    let gender = gender(
        container
            .get("gender")?
            .or_else(|| in_details("gender"))
            .as_ref(),
    );
    Ok(vec![PoseTrack {
        person: "0".to_owned(),
        gender,
        shape_space,
        betas: betas(container.get("betas")?.as_ref(), count)?,
        frame_ids: None,
        rotations,
        trans: Some(trans),
        pelvis_turns: None,
        axes: PoseAxes::Up(Vector3::z()),
        rate_hz: rate.as_ref().map(checked_rate).transpose()?,
        confidence: None,
    }])
}

/// The rate, Hz, where a motion can have it.
fn checked_rate(entry: &Entry) -> Result<f64, MotionError> {
    let rate_hz = entry.float()?;
    if RATES_HZ.contains(&rate_hz) {
        Ok(rate_hz)
    } else {
        Err(wrong(
            entry,
            format!("the rate is {rate_hz} Hz, expected {RATES_TEXT}; set rate_hz"),
        ))
    }
}

/// The rotations, and how many values a row of the pose has.
fn poses<R: Read + Seek>(
    container: &mut Container<R>,
    budget: &mut Budget,
) -> Result<(Vec<Rotations>, usize), MotionError> {
    for key in ["poses", "fullpose"] {
        let Some(entry) = container.get(key)? else {
            continue;
        };
        let shape = entry.shape()?;
        let (count, width) = match shape[..] {
            [count, width] if WIDTHS.contains(&width) => (count, width),
            _ => {
                let found = shape.iter().map(|&size| size as u64).collect();
                let expected =
                    "(N, 72) of SMPL, (N, 156) of SMPL-H or (N, 165) of SMPL-X".to_owned();
                return Err(ArraysError::Shape {
                    path: entry.path().to_owned(),
                    key: key.to_owned(),
                    found,
                    expected,
                }
                .into());
            }
        };
        budget.take(key, count)?;
        let rows = numbers(&entry, &[None, None], "(N, 156)")?;
        let joints = if width == 72 { 24 } else { SHARED_JOINTS };
        check_angles(&entry, &rows.values, width, 0..=joints - 1)?;
        return Ok((
            rotations_from_axis_angles(&rows.values, width, joints),
            width,
        ));
    }
    let orient = container.at("root_orient")?;
    let count = frame_count(&orient);
    budget.take("root_orient", count)?;
    let root = numbers(&orient, &[Some(count), Some(3)], "(N, 3)")?;
    check_angles(&orient, &root.values, 3, 0..=0)?;
    let body = body_angles(&container.at("pose_body")?, count)?;
    Ok((
        rotations_from_root_and_body(&root.values, &body.values),
        3 * SHARED_JOINTS,
    ))
}
