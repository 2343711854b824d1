//! PHALP, the tracker of 4D-Humans: a dictionary of frames, each with the people's numbers `tid`,
//! their `smpl` (`global_orient` (1, 3, 3), `body_pose` (23, 3, 3), `betas` (10)) in the camera's
//! axes, and `time`, the frame's number. People whom it has lost for a while are guessed
//! (`tracked_time` above 0): such frames have confidence 0.

use std::collections::BTreeMap;

use cromosim_arrays::{Array, Entry};
use cromosim_body::ShapeSpace;

use super::track::{PoseAxes, PoseTrack};
use super::values::{Budget, betas, in_frames, numbers, rotations_from_matrices, wrong};
use crate::MotionError;

/// Everybody whom the file names, by number.
pub(super) fn tracks(root: &Entry, budget: &mut Budget) -> Result<Vec<PoseTrack>, MotionError> {
    let mut frames = Vec::new();
    for (index, (_, frame)) in root.pairs()?.into_iter().enumerate() {
        let time = frame
            .get("time")
            .map_or(Ok(index as i64), |time| time.integer())?;
        frames.push((time, frame));
    }
    frames.sort_by_key(|(time, _)| *time);
    let mut people: BTreeMap<i64, PoseTrack> = BTreeMap::new();
    for (time, frame) in &frames {
        let tid = frame.at("tid")?;
        let ids = tid.integers(&[None], "(P), one number a person")?.values;
        let bodies = frame.at("smpl")?;
        let items = bodies.items()?;
        if items.len() != ids.len() {
            return Err(wrong(
                &bodies,
                format!("{} bodies for the {} people of tid", items.len(), ids.len()),
            ));
        }
        let lost = match frame.get("tracked_time") {
            Some(lost) => {
                lost.integers(&[None], "(P), frames since the person was seen")?
                    .values
            }
            None => Vec::new(),
        };
        for (index, (id, body)) in ids.iter().zip(&items).enumerate() {
            budget.take(body.key(), 1)?;
            let track = people.entry(*id).or_insert_with(|| empty(*id));
            if track.frame_ids.as_ref().and_then(|times| times.last()) == Some(time) {
                return Err(wrong(
                    &tid,
                    format!("person {id} stands twice in the frame of time {time}"),
                ));
            }
            add(
                track,
                *time,
                body,
                lost.get(index).is_none_or(|&frames| frames <= 0),
            )?;
        }
    }
    Ok(people.into_values().collect())
}

/// A track without frames.
fn empty(id: i64) -> PoseTrack {
    PoseTrack {
        person: id.to_string(),
        gender: None,
        shape_space: ShapeSpace::Smpl,
        betas: Array {
            shape: vec![0, 0],
            values: Vec::new(),
        },
        frame_ids: Some(Vec::new()),
        rotations: Vec::new(),
        trans: None,
        pelvis_turns: None,
        axes: PoseAxes::Camera,
        rate_hz: None,
        confidence: Some(Vec::new()),
    }
}

/// Adds a frame to a track.
fn add(track: &mut PoseTrack, time: i64, body: &Entry, seen: bool) -> Result<(), MotionError> {
    let mut rotations = matrices(&body.at("global_orient")?, 1)?;
    rotations.extend(matrices(&body.at("body_pose")?, 23)?);
    track.rotations.extend(in_frames(&rotations));
    if let Some(times) = &mut track.frame_ids {
        times.push(time);
    }
    if let Some(confidence) = &mut track.confidence {
        confidence.push(f64::from(u8::from(seen)));
    }
    let row = betas(body.get("betas").as_ref(), 1)?;
    let count = row.shape.get(1).copied().unwrap_or(0);
    if track.betas.shape[0] == 0 {
        track.betas.shape = vec![0, count];
    } else if track.betas.shape[1] != count {
        return Err(wrong(
            body,
            format!(
                "{count} betas, but {} in the person's frames before",
                track.betas.shape[1]
            ),
        ));
    }
    track.betas.shape[0] += 1;
    track.betas.values.extend(row.values);
    Ok(())
}

/// `count` matrices: (count, 3, 3), or (3, 3) of one.
fn matrices(
    entry: &Entry,
    count: usize,
) -> Result<Vec<nalgebra::UnitQuaternion<f64>>, MotionError> {
    let expected: &[Option<usize>] = if count == 1 && entry.shape()?.len() == 2 {
        &[Some(3), Some(3)]
    } else {
        &[Some(count), Some(3), Some(3)]
    };
    let array = numbers(entry, expected, &format!("({count}, 3, 3)"))?;
    rotations_from_matrices(entry, &array.values)
}
