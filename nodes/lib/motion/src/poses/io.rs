//! Opening pose files, and what lies beside them.

use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_arrays::{ArraysError, Container, Entry, Format, Limits};
use cromosim_body::BodyModel;

use super::file::PoseFile;
use super::format::PoseView;
use crate::{MotionError, MotionOptions, SmplMotion};

/// The poses in the file at `path`; `None` where it is no file of arrays. From an npz only the
/// arrays that matter are read. TRAM's `camera.npy` is looked for in the folder of the file and in the one
/// above.
///
/// # Errors
/// [`MotionError::Read`], and those of [`PoseFile::parse`].
pub fn open_poses(path: &Path, view: PoseView) -> Result<Option<PoseFile>, MotionError> {
    let unreadable = |source| MotionError::Read {
        path: path.to_owned(),
        source,
    };
    let file = cromosim_spatial::open_file(path).map_err(unreadable)?;
    // A directory has no bytes at all.
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

/// TRAM's cameras, in a file of their own.
fn camera_beside(path: &Path) -> Result<Option<Entry>, ArraysError> {
    let folders = path.ancestors().skip(1).take(2);
    let found: Option<PathBuf> = folders
        .map(|folder| folder.join("camera.npy"))
        .find(|camera| camera.is_file() && camera != path);
    found
        .map(|camera| Container::open(&camera)?.root())
        .transpose()
}

/// The body that the file's betas are for, where the options name it.
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
