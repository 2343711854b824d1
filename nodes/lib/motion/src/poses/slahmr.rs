//! SLAHMR: P people over the T frames of a video, `root_orient` (P, T, 3), `pose_body` (P, T, 63),
//! `trans` (P, T, 3) and `betas` (P, B) in the axes of the first camera; `floor_plane`, where there
//! is one, tells which way is up. `track_mask` (P, T) says who is seen when.

use std::io::{Read, Seek};

use cromosim_arrays::{Array, Container, Entry};
use cromosim_body::ShapeSpace;
use nalgebra::Vector3;

use super::track::{PoseAxes, PoseTrack};
use super::values::{Budget, check_angles, numbers, rotations_from_root_and_body, wrong};
use crate::MotionError;

/// More people than any video shows.
const MAX_PEOPLE: usize = 1000;

/// Everybody who is seen in at least one frame.
pub(super) fn tracks<R: Read + Seek>(
    container: &mut Container<R>,
    budget: &mut Budget,
) -> Result<Vec<PoseTrack>, MotionError> {
    let video = Video::read(container, budget)?;
    let tracks = (0..video.people).filter_map(|person| {
        let track = upright(video.track(person));
        match &video.seen {
            Some(seen) => only_seen(track, &seen.values[person * video.frames..][..video.frames]),
            None => Some(track),
        }
    });
    Ok(tracks.collect())
}

/// The arrays of a file: P people over T frames.
struct Video {
    people: usize,
    frames: usize,
    /// (P, T, 3), axis times angle.
    orients: Array<f64>,
    /// (P, T, 63), axis times angle.
    bodies: Array<f64>,
    /// (P, T, 3), m.
    trans: Array<f64>,
    /// (P, B).
    betas: Option<Array<f64>>,
    /// (P, T), 0 where the person is not seen.
    seen: Option<Array<f64>>,
    axes: PoseAxes,
}

impl Video {
    fn read<R: Read + Seek>(
        container: &mut Container<R>,
        budget: &mut Budget,
    ) -> Result<Self, MotionError> {
        let root = container.at("root_orient")?;
        let shape = root.shape()?;
        let (people, frames) = people_and_frames(&root)?;
        budget.take(root.key(), people.saturating_mul(frames))?;
        // One person alone may come without the first dimension.
        let expected = |width: usize| match shape.len() {
            2 => vec![Some(frames), Some(width)],
            _ => vec![Some(people), Some(frames), Some(width)],
        };
        let orients = numbers(&root, &expected(3), "(P, T, 3)")?;
        check_angles(&root, &orients.values, 3, 0..=0)?;
        let text = format!("({people}, {frames}, 3)");
        let trans = numbers(&container.at("trans")?, &expected(3), &text)?;
        let bodies = container.at("pose_body")?;
        let wide = if bodies.shape()?.len() == shape.len() {
            expected(63)
        } else {
            [&expected(21)[..], &[Some(3)]].concat()
        };
        let key = bodies;
        let bodies = numbers(&key, &wide, &format!("({people}, {frames}, 63)"))?;
        check_angles(&key, &bodies.values, 63, 1..=21)?;
        Ok(Self {
            people,
            frames,
            orients,
            bodies,
            trans,
            betas: optional(container, "betas", &format!("({people}, B)"), |rank| {
                if rank == 1 {
                    vec![None]
                } else {
                    vec![Some(people), None]
                }
            })?,
            seen: optional(
                container,
                "track_mask",
                &format!("({people}, {frames})"),
                |_| vec![Some(people), Some(frames)],
            )?,
            axes: axes(container)?,
        })
    }

    /// A person's poses in all frames.
    fn track(&self, person: usize) -> PoseTrack {
        let (first, count) = (person * self.frames, self.frames);
        let trans = self.trans.values[first * 3..][..count * 3]
            .chunks_exact(3)
            .map(Vector3::from_column_slice);
        let beta_count = self
            .betas
            .as_ref()
            .and_then(|betas| betas.shape.last().copied())
            .unwrap_or(0);
        let betas = self.betas.iter().flat_map(|betas| {
            let all = betas.values.iter().copied();
            all.skip(person * beta_count).take(beta_count)
        });
        PoseTrack {
            person: person.to_string(),
            gender: None,
            shape_space: ShapeSpace::Smpl,
            betas: Array {
                shape: vec![1, beta_count],
                values: betas.collect(),
            },
            frame_ids: None,
            rotations: rotations_from_root_and_body(
                &self.orients.values[first * 3..][..count * 3],
                &self.bodies.values[first * 63..][..count * 63],
            ),
            trans: Some(trans.collect()),
            pelvis_turns: None,
            axes: self.axes,
            rate_hz: None,
            confidence: None,
        }
    }
}

/// The numbers of people and of frames by the shape of `root_orient`.
fn people_and_frames(root: &Entry) -> Result<(usize, usize), MotionError> {
    let shape = root.shape()?;
    match shape[..] {
        [frames, 3] => Ok((1, frames)),
        [people, frames, 3] if (1..=MAX_PEOPLE).contains(&people) => Ok((people, frames)),
        _ => Err(wrong(
            root,
            format!("shape is {shape:?}, expected (P, T, 3) of at most {MAX_PEOPLE} people"),
        )),
    }
}

/// The numbers under a key, where it is there; `expected` is the shape by the array's rank.
fn optional<R: Read + Seek>(
    container: &mut Container<R>,
    key: &str,
    text: &str,
    expected: impl Fn(usize) -> Vec<Option<usize>>,
) -> Result<Option<Array<f64>>, MotionError> {
    let Some(entry) = container.get(key)? else {
        return Ok(None);
    };
    let rank = entry.shape()?.len();
    Ok(Some(numbers(&entry, &expected(rank), text)?))
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

/// Up is the normal of the floor where the file has one, else it is found by the heads.
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
