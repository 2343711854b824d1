//! Opening pose files, and what lies beside them.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_arrays::{ArraysError, Container, Entry, Format, Limits};
use cromosim_body::BodyModel;

use super::body::CameraPoses;
use super::file::{PoseFile, PoseView};
use crate::{MotionError, MotionOptions, SmplMotion};

/// The poses in the file at `path`; `None` where it is no file of arrays. Of an npz only the arrays
/// that matter are read. TRAM's `camera.npy` is looked for in the folder of the file and in the one
/// above.
///
/// # Errors
/// [`MotionError::Read`], and those of [`PoseFile::parse`].
pub fn open_poses(path: &Path, view: PoseView) -> Result<Option<PoseFile>, MotionError> {
    let unreadable = |source| MotionError::Read {
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(unreadable)?;
    // Of a pipe the first bytes cannot be read twice.
    if !file.metadata().map_err(unreadable)?.is_file() {
        return Ok(None);
    }
    let mut reader = BufReader::new(file);
    if Format::detect(&mut reader).map_err(unreadable)?.is_none() {
        return Ok(None);
    }
    let mut container = Container::without(reader, path, Limits::default(), super::amass::SKIPPED)?;
    PoseFile::parse(&mut container, view, || camera_beside(path)).map(Some)
}

fn camera_beside(path: &Path) -> Result<Option<Entry>, ArraysError> {
    let folders = path.ancestors().skip(1).take(2);
    let found: Option<PathBuf> = folders
        .map(|folder| folder.join("camera.npy"))
        .find(|camera| camera.is_file() && camera != path);
    found
        .map(|camera| Container::open(&camera)?.root())
        .transpose()
}

pub(super) fn source_body(options: &MotionOptions) -> Result<Option<Arc<BodyModel>>, MotionError> {
    Ok(options
        .source_body
        .as_deref()
        .map(BodyModel::read)
        .transpose()?)
}

/// The motion in a file of SMPL parameters, whole; `None` where it is no file of arrays.
pub(crate) fn read_poses(
    path: &Path,
    body: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<Option<SmplMotion>, MotionError> {
    let Some(file) = open_poses(path, PoseView::World)? else {
        return Ok(None);
    };
    file.into_motion(body, source_body(options)?.as_ref(), options)
        .map(Some)
}

/// Everybody in a file of video estimates in the camera's axes, in place: what a global trajectory
/// is made from. WHAM's and GVHMR's estimates in the camera are taken.
///
/// # Errors
/// Those of [`PoseFile::parse`] and [`PoseFile::into_camera_poses`]; [`MotionError::Key`] where the
/// file has no poses in a camera's axes.
pub fn read_camera_poses(
    path: &Path,
    body: &Arc<BodyModel>,
    options: &MotionOptions,
) -> Result<Vec<CameraPoses>, MotionError> {
    let none = || {
        super::values::problem(
            path,
            "pose",
            "no poses in a camera's axes; VIBE, PHALP, WHAM, GVHMR and TRAM have such",
        )
    };
    let file = open_poses(path, PoseView::Camera)?.ok_or_else(none)?;
    let poses = file.into_camera_poses(body, options)?;
    if poses.is_empty() {
        Err(none())
    } else {
        Ok(poses)
    }
}
