//! A file of poses: which format it has, and who is in it.

use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_arrays::{ArraysError, Container, Entry};
use cromosim_body::BodyModel;

use super::body::{CameraPoses, OnBody};
use super::format::{MAX_POSES, PoseFormat, PoseView};
use super::report::people_text;
use super::track::PoseTrack;
use super::values::{Budget, problem, too_long};
use super::{amass, dip, gvhmr, phalp, slahmr, tram, vibe, wham};
use crate::{MotionError, MotionOptions, SmplMotion};

/// The people of a file, at least one.
#[derive(Clone, Debug)]
pub struct PoseFile {
    /// Names the file, in errors too.
    pub path: PathBuf,
    /// Who wrote it.
    pub format: PoseFormat,
    /// Its people in the file's order (PHALP's by number), each with at least one frame.
    pub tracks: Vec<PoseTrack>,
}

impl PoseFile {
    /// Reads the arrays that matter out of a container. `camera` is asked for TRAM's other file,
    /// and only for TRAM; without it TRAM stays in the camera's axes.
    ///
    /// # Errors
    /// [`MotionError::UnknownPoses`], [`MotionError::BodyFile`] by the keys;
    /// [`MotionError::Arrays`] and [`MotionError::Key`] for arrays of other shapes, NaN, no frames,
    /// matrices that are no rotations, frame numbers that do not rise.
    pub fn parse<R: Read + Seek>(
        container: &mut Container<R>,
        view: PoseView,
        camera: impl FnOnce() -> Result<Option<Entry>, ArraysError>,
    ) -> Result<Self, MotionError> {
        let path = container.path().to_owned();
        let mut budget = Budget::new(&path);
        let keys = container.keys();
        if has_all(&keys, &["v_template"]) {
            return Err(MotionError::BodyFile { path });
        }
        let by_keys = tracks_by_keys(container, &keys, view, camera, &mut budget)?;
        let (format, tracks) = match by_keys {
            Some(found) => found,
            None => {
                let is_npz = keys
                    .first()
                    .is_some_and(|key| !matches!(container.header(key), Ok(None)));
                if is_npz {
                    let found = format!("the keys {}", first_of(&keys));
                    return Err(MotionError::UnknownPoses { path, found });
                }
                tracks_by_items(&path, &container.root()?, view, &mut budget)?
            }
        };
        if tracks.is_empty() {
            let key = if format == PoseFormat::Phalp {
                "tid"
            } else {
                "track_mask"
            };
            return Err(problem(&path, key, "nobody is seen in any frame"));
        }
        Ok(Self {
            path,
            format,
            tracks,
        })
    }

    /// Everybody and their numbers of frames.
    pub fn people(&self) -> Vec<(String, usize)> {
        self.tracks
            .iter()
            .map(|track| (track.person.clone(), track.rotations.len()))
            .collect()
    }

    /// Index of a person's track; without a name, of the longest one (the first of these).
    ///
    /// # Errors
    /// [`MotionError::UnknownPerson`] with the people that there are.
    pub fn choose(&self, person: Option<&str>) -> Result<usize, MotionError> {
        let longest = || {
            (0..self.tracks.len())
                .rev()
                .max_by_key(|&index| self.tracks[index].rotations.len())
        };
        let index = match person {
            Some(person) => self.tracks.iter().position(|track| track.person == person),
            None => longest(),
        };
        index.ok_or_else(|| MotionError::UnknownPerson {
            path: self.path.clone(),
            person: person.unwrap_or_default().to_owned(),
            known: people_text(&self.people()),
        })
    }

    /// The motion of the person that the options name, on `body`; `source_body` is the body that
    /// the file's betas are for. `start_s` and `duration_s` are for [`SmplMotion::slice`] and not
    /// used here.
    ///
    /// # Errors
    /// [`MotionError::UnknownPerson`], [`MotionError::ForeignShape`], [`MotionError::UpAxis`],
    /// [`MotionError::Setting`] for a rate.
    pub fn into_motion(
        mut self,
        body: &Arc<BodyModel>,
        source_body: Option<&Arc<BodyModel>>,
        options: &MotionOptions,
    ) -> Result<SmplMotion, MotionError> {
        let index = self.choose(options.person.as_deref())?;
        let people = self.people();
        let track = self.tracks.swap_remove(index);
        self.on_body(&people, body, source_body, options)
            .motion(track)
    }

    /// As [`Self::into_motion`] for the people that [`MotionOptions::person`] names (`all` or
    /// nothing: everybody; else names with commas between), in that order and each once.
    /// [`PoseReport::person`](super::PoseReport) tells them apart.
    ///
    /// # Errors
    /// As [`Self::into_motion`].
    pub fn into_motions(
        mut self,
        body: &Arc<BodyModel>,
        source_body: Option<&Arc<BodyModel>>,
        options: &MotionOptions,
    ) -> Result<Vec<SmplMotion>, MotionError> {
        let people = self.people();
        let mut chosen: Vec<usize> = match options.people() {
            Some(names) => names
                .into_iter()
                .map(|name| self.choose(Some(name)))
                .collect::<Result<_, _>>()?,
            None => (0..people.len()).collect(),
        };
        let mut seen = vec![false; people.len()];
        chosen.retain(|&index| !std::mem::replace(&mut seen[index], true));
        let mut tracks: Vec<Option<PoseTrack>> = std::mem::take(&mut self.tracks)
            .into_iter()
            .map(Some)
            .collect();
        let on_body = self.on_body(&people, body, source_body, options);
        let mut left = MAX_POSES;
        let mut motion = |track: PoseTrack| {
            let motion = on_body.motion(track)?;
            left = left
                .checked_sub(motion.frames.len())
                .ok_or_else(|| too_long(&self.path))?;
            Ok(motion)
        };
        chosen
            .into_iter()
            .filter_map(|index| tracks[index].take())
            .map(&mut motion)
            .collect()
    }

    /// Everybody in the camera's axes, in place; people whose poses are in a world are left out.
    /// Betas are given where they are those of `body`.
    ///
    /// # Errors
    /// [`MotionError::Setting`] for a rate.
    pub fn into_camera_poses(
        mut self,
        body: &Arc<BodyModel>,
        options: &MotionOptions,
    ) -> Result<Vec<CameraPoses>, MotionError> {
        let people = self.people();
        let tracks = std::mem::take(&mut self.tracks);
        let on_body = self.on_body(&people, body, None, options);
        tracks
            .into_iter()
            .filter_map(|track| on_body.camera_poses(&track).transpose())
            .collect()
    }

    fn on_body<'a>(
        &'a self,
        people: &'a [(String, usize)],
        body: &'a Arc<BodyModel>,
        source_body: Option<&'a Arc<BodyModel>>,
        options: &'a MotionOptions,
    ) -> OnBody<'a> {
        OnBody {
            path: &self.path,
            format: self.format,
            people,
            body,
            source_body,
            options,
        }
    }
}

/// Whether all wanted keys are there.
fn has_all(keys: &[String], wanted: &[&str]) -> bool {
    wanted
        .iter()
        .all(|wanted| keys.iter().any(|key| key == wanted))
}

/// The tracks of a file whose own keys tell its format; `None` for any other file.
fn tracks_by_keys<R: Read + Seek>(
    container: &mut Container<R>,
    keys: &[String],
    view: PoseView,
    camera: impl FnOnce() -> Result<Option<Entry>, ArraysError>,
    budget: &mut Budget,
) -> Result<Option<(PoseFormat, Vec<PoseTrack>)>, MotionError> {
    let has = |wanted: &[&str]| has_all(keys, wanted);
    Ok(Some(if has(&["smpl_params_global"]) {
        let track = gvhmr::track(&container.root()?, view, budget)?;
        (PoseFormat::Gvhmr, vec![track])
    } else if has(&["pred_rotmat"]) {
        let camera = if view == PoseView::World {
            camera()?
        } else {
            None
        };
        let track = tram::track(&container.root()?, camera.as_ref(), view, budget)?;
        (PoseFormat::Tram, vec![track])
    } else if has(&["root_orient", "cam_R"]) {
        (PoseFormat::Slahmr, slahmr::tracks(container, budget)?)
    } else if has(&["trans"])
        && (has(&["poses"]) || has(&["fullpose"]) || has(&["root_orient", "pose_body"]))
    {
        (PoseFormat::Amass, amass::tracks(container, budget)?)
    } else if has(&["gt", "imu_ori", "imu_acc"]) {
        (PoseFormat::Dip, vec![dip::track(container, budget)?])
    } else {
        return Ok(None);
    }))
}

/// The tracks of a dictionary of people or of frames, told by the keys of its first item.
fn tracks_by_items(
    path: &Path,
    root: &Entry,
    view: PoseView,
    budget: &mut Budget,
) -> Result<(PoseFormat, Vec<PoseTrack>), MotionError> {
    let unknown = |found: String| MotionError::UnknownPoses {
        path: path.to_owned(),
        found,
    };
    let Ok(entries) = root.pairs() else {
        return Err(unknown(root.value().type_name().to_owned()));
    };
    let Some((_, first)) = entries.first() else {
        return Err(unknown("an empty dictionary".to_owned()));
    };
    let people = entries.iter().map(|(_, person)| person);
    if first.get("pose_world").is_some() {
        let tracks = people.map(|person| wham::track(person, view, budget));
        Ok((PoseFormat::Wham, tracks.collect::<Result<_, _>>()?))
    } else if first.get("pose").is_some() {
        let tracks = people.map(|person| vibe::track(person, budget));
        Ok((PoseFormat::Vibe, tracks.collect::<Result<_, _>>()?))
    } else if first.get("tid").is_some() && first.get("smpl").is_some() {
        Ok((PoseFormat::Phalp, phalp::tracks(root, budget)?))
    } else {
        let keys: Vec<String> = people.map(|entry| entry.key().to_owned()).collect();
        Err(unknown(format!("the keys {}", first_of(&keys))))
    }
}

/// The first twelve keys, for an error.
fn first_of(keys: &[String]) -> String {
    let more = if keys.len() > 12 {
        format!(" and {} more", keys.len() - 12)
    } else {
        String::new()
    };
    format!(
        "{}{more}",
        keys.iter()
            .take(12)
            .map(String::as_str)
            .collect::<Vec<_>>()
            .join(", ")
    )
}
