//! SLAHMR: P people over the T frames of a video, `root_orient` (P, T, 3), `pose_body` (P, T, 63),
//! `trans` (P, T, 3) and `betas` (P, B) in the axes of the first camera; `floor_plane`, where there
//! is one, tells which way is up. `track_mask` (P, T) says who is seen when.

use std::io::{Read, Seek};

use cromosim_arrays::{Array, Container};
use cromosim_body::ShapeSpace;
use nalgebra::Vector3;

use super::track::{PoseAxes, PoseTrack};
use super::values::{Budget, numbers, of_root_and_body, wrong};
use crate::MotionError;

/// More than any video shows.
const MAX_PEOPLE: usize = 1000;

pub(super) fn tracks<R: Read + Seek>(
    container: &mut Container<R>,
    budget: &mut Budget,
) -> Result<Vec<PoseTrack>, MotionError> {
    let root = container.at("root_orient")?;
    let shape = root.shape()?;
    // One person alone may come without the first dimension.
    let alone = shape.len() == 2;
    let (people, count) = match shape[..] {
        [count, 3] => (1, count),
        [people, count, 3] if (1..=MAX_PEOPLE).contains(&people) => (people, count),
        _ => {
            return Err(wrong(
                &root,
                format!("shape is {shape:?}, expected (P, T, 3) of at most {MAX_PEOPLE} people"),
            ));
        }
    };
    budget.take(root.key(), people.saturating_mul(count))?;
    let expected = |width: usize| {
        if alone {
            vec![Some(count), Some(width)]
        } else {
            vec![Some(people), Some(count), Some(width)]
        }
    };
    let orients = numbers(&root, &expected(3), "(P, T, 3)")?;
    let trans = numbers(
        &container.at("trans")?,
        &expected(3),
        &format!("({people}, {count}, 3)"),
    )?;
    let bodies = container.at("pose_body")?;
    let flat = bodies.shape()?.len() == shape.len();
    let wide = if flat {
        expected(63)
    } else {
        [&expected(21)[..], &[Some(3)]].concat()
    };
    let bodies = numbers(&bodies, &wide, &format!("({people}, {count}, 63)"))?;
    let betas = match container.get("betas")? {
        Some(entry) => {
            let rank = entry.shape()?.len();
            let rows = if rank == 1 {
                vec![None]
            } else {
                vec![Some(people), None]
            };
            Some(numbers(&entry, &rows, &format!("({people}, B)"))?)
        }
        None => None,
    };
    let seen = match container.get("track_mask")? {
        Some(entry) => Some(numbers(
            &entry,
            &[Some(people), Some(count)],
            &format!("({people}, {count})"),
        )?),
        None => None,
    };
    let axes = axes(container)?;
    let person = |index: usize| {
        let rotations = of_root_and_body(
            &orients.values[index * count * 3..][..count * 3],
            &bodies.values[index * count * 63..][..count * 63],
        );
        let places = trans.values[index * count * 3..][..count * 3]
            .chunks_exact(3)
            .map(Vector3::from_column_slice);
        let beta_count = betas
            .as_ref()
            .and_then(|betas| betas.shape.last().copied())
            .unwrap_or(0);
        let own_betas = betas.iter().flat_map(|betas| {
            betas
                .values
                .iter()
                .copied()
                .skip(index * beta_count)
                .take(beta_count)
        });
        let track = PoseTrack {
            person: index.to_string(),
            gender: None,
            shape_space: ShapeSpace::Smpl,
            betas: Array {
                shape: vec![1, beta_count],
                values: own_betas.collect(),
            },
            frame_ids: None,
            rotations,
            trans: Some(places.collect()),
            pelvis_turns: None,
            axes,
            rate_hz: None,
            confidence: None,
        };
        upright(track)
    };
    let tracks = (0..people)
        .map(person)
        .enumerate()
        .filter_map(|(index, track)| match &seen {
            Some(seen) => only_seen(track, &seen.values[index * count..][..count]),
            None => Some(track),
        });
    Ok(tracks.collect())
}

/// The frames in which the person is seen; `None` without any.
fn only_seen(mut track: PoseTrack, seen: &[f64]) -> Option<PoseTrack> {
    let kept: Vec<usize> = (0..seen.len())
        .filter(|&frame| seen[frame] != 0.0)
        .collect();
    track.rotations = kept.iter().map(|&frame| track.rotations[frame]).collect();
    track.trans = track
        .trans
        .map(|trans| kept.iter().map(|&frame| trans[frame]).collect());
    track.frame_ids = Some(kept.iter().map(|&frame| frame as i64).collect());
    (!kept.is_empty()).then_some(track)
}

/// A plane has two normals: up is the one that the body agrees with.
fn upright(mut track: PoseTrack) -> PoseTrack {
    if let PoseAxes::Up(normal) = track.axes
        && normal.dot(&track.mean_upward()) < 0.0
    {
        track.axes = PoseAxes::Up(-normal);
    }
    track
}

/// Up is the floor's normal.
fn axes<R: Read + Seek>(container: &mut Container<R>) -> Result<PoseAxes, MotionError> {
    let Some(entry) = container.get("floor_plane")? else {
        return Ok(PoseAxes::Detect);
    };
    let rank = entry.shape()?.len();
    let planes = numbers(&entry, &vec![None; rank], "(3), (4), (1, 3) or (1, 4)")?;
    let normal = planes
        .values
        .get(..3)
        .map(Vector3::from_column_slice)
        .and_then(|normal| normal.try_normalize(1e-9));
    normal
        .map(PoseAxes::Up)
        .ok_or_else(|| wrong(&entry, "it has no direction, expected a plane's normal"))
}
