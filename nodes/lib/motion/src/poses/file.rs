//! A file of poses: whose format it is, who is in it.

use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_arrays::{ArraysError, Container, Entry};
use cromosim_body::BodyModel;

use super::body::{CameraPoses, OnBody};
use super::report::people_text;
use super::track::PoseTrack;
use super::values::{Budget, problem};
use super::{PoseFormat, amass, dip, gvhmr, phalp, slahmr, tram, vibe, wham};
use crate::{MotionError, MotionOptions, SmplMotion};

/// Which of its estimates is taken of a file that holds both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PoseView {
    /// The one in a world, where there is one.
    #[default]
    World,
    /// The one in the camera's axes.
    Camera,
}

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
        let found = |format, tracks| {
            Ok(Self {
                path: path.clone(),
                format,
                tracks,
            })
        };
        let keys = container.keys();
        let has = |wanted: &[&str]| {
            wanted
                .iter()
                .all(|wanted| keys.iter().any(|key| key == wanted))
        };
        if has(&["v_template"]) {
            return Err(MotionError::BodyFile { path });
        }
        if has(&["smpl_params_global"]) {
            return found(
                PoseFormat::Gvhmr,
                vec![gvhmr::track(&container.root()?, view, &mut budget)?],
            );
        }
        if has(&["pred_rotmat"]) {
            let camera = if view == PoseView::World {
                camera()?
            } else {
                None
            };
            return found(
                PoseFormat::Tram,
                vec![tram::track(
                    &container.root()?,
                    camera.as_ref(),
                    view,
                    &mut budget,
                )?],
            );
        }
        if has(&["root_orient", "cam_R"]) {
            let tracks = slahmr::tracks(container, &mut budget)?;
            return if tracks.is_empty() {
                Err(problem(&path, "track_mask", "nobody is seen in any frame"))
            } else {
                found(PoseFormat::Slahmr, tracks)
            };
        }
        if has(&["trans"])
            && (has(&["poses"]) || has(&["fullpose"]) || has(&["root_orient", "pose_body"]))
        {
            return found(PoseFormat::Amass, amass::tracks(container, &mut budget)?);
        }
        if has(&["gt", "imu_ori", "imu_acc"]) {
            return found(PoseFormat::Dip, vec![dip::track(container, &mut budget)?]);
        }
        let is_npz = keys
            .first()
            .is_some_and(|key| !matches!(container.header(key), Ok(None)));
        let unknown = |found: String| {
            Err(MotionError::UnknownPoses {
                path: path.clone(),
                found,
            })
        };
        if is_npz {
            return unknown(format!("the keys {}", first_of(&keys)));
        }
        let root = container.root()?;
        let Ok(entries) = root.pairs() else {
            return unknown(root.value().type_name().to_owned());
        };
        let Some((_, first)) = entries.first() else {
            return unknown("an empty dictionary".to_owned());
        };
        let people = entries.iter().map(|(_, person)| person);
        if first.get("pose_world").is_some() {
            found(
                PoseFormat::Wham,
                people
                    .map(|person| wham::track(person, view, &mut budget))
                    .collect::<Result<_, _>>()?,
            )
        } else if first.get("pose").is_some() {
            found(
                PoseFormat::Vibe,
                people
                    .map(|person| vibe::track(person, &mut budget))
                    .collect::<Result<_, _>>()?,
            )
        } else if first.get("tid").is_some() && first.get("smpl").is_some() {
            let tracks = phalp::tracks(&root, &mut budget)?;
            if tracks.is_empty() {
                Err(problem(&path, "tid", "nobody is seen in any frame"))
            } else {
                found(PoseFormat::Phalp, tracks)
            }
        } else {
            unknown(format!(
                "the keys {}",
                first_of(
                    &entries
                        .iter()
                        .map(|(_, entry)| entry.key().to_owned())
                        .collect::<Vec<_>>()
                )
            ))
        }
    }

    /// Everybody and their numbers of frames.
    pub fn people(&self) -> Vec<(String, usize)> {
        self.tracks
            .iter()
            .map(|track| (track.person.clone(), track.rotations.len()))
            .collect()
    }

    /// The place of a person among the tracks; of the one with most frames (the first of these)
    /// without a name.
    ///
    /// # Errors
    /// [`MotionError::UnknownPerson`] with the people that there are.
    pub fn choose(&self, person: Option<&str>) -> Result<usize, MotionError> {
        let longest = || {
            (0..self.tracks.len())
                .rev()
                .max_by_key(|&index| self.tracks[index].rotations.len())
        };
        let place = match person {
            Some(person) => self.tracks.iter().position(|track| track.person == person),
            None => longest(),
        };
        place.ok_or_else(|| MotionError::UnknownPerson {
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
        let mut left = super::MAX_POSES;
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

pub(super) fn too_long(path: &Path) -> MotionError {
    problem(
        path,
        "frame_ids",
        format!(
            "more than {} frames with the gaps bridged; cut the file into parts",
            super::MAX_POSES
        ),
    )
}

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
