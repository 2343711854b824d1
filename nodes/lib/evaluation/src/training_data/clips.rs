//! Motions out of files, skeleton clips with labels among them.

use std::path::Path;
use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose};
use cromosim_learned::KnownMotion;
use cromosim_motion::{MotionOptions, read_motion_for, retarget};
use cromosim_recording::datasets::{LabelledClip, parse_skeleton_npz};

use crate::EvaluationError;

/// Skeleton clips as npz begin with what is left of a blend out of the T-pose: hands come down with
/// 300 m/s2.
const BLEND_FRAMES: usize = 6;

/// A motion as poses of the body.
pub struct MotionClip {
    /// The file's name without its ending.
    pub name: String,
    /// One pose a frame.
    pub poses: Vec<BodyPose>,
    /// Frames per second, Hz.
    pub rate_hz: f64,
    /// For each frame whether a joint flips there; empty where the file does not say.
    pub suspect: Vec<bool>,
}

impl MotionClip {
    /// As the drawing of devices takes it.
    pub fn known(&self) -> KnownMotion<'_> {
        KnownMotion {
            poses: &self.poses,
            rate_hz: self.rate_hz,
            suspect: &self.suspect,
        }
    }
}

/// A skeleton clip with what its frames show.
pub struct LabelledMotion {
    /// The motion on the body.
    pub motion: MotionClip,
    /// One a frame, or none at all.
    pub labels: Vec<Option<String>>,
    /// Why it is unlike everyday motion; empty where it is not.
    pub atypical: String,
}

/// Reads a skeleton clip (npz) without the blend that it begins with.
///
/// # Errors
/// A file that cannot be read, or is no skeleton clip.
pub fn read_labelled_motion(
    path: &Path,
    model: &Arc<BodyModel>,
) -> Result<LabelledMotion, EvaluationError> {
    on_body(parse_skeleton(path)?, path, model)
}

/// Reads a motion of any kind, skeleton clips as npz among them; `skeleton_map` as
/// [`MotionOptions::skeleton_map`].
///
/// # Errors
/// A file that cannot be read, or is no motion.
pub fn read_motion_clip(
    path: &Path,
    model: &Arc<BodyModel>,
    skeleton_map: Option<&str>,
) -> Result<MotionClip, EvaluationError> {
    if let Ok(clip) = parse_skeleton(path) {
        return Ok(on_body(clip, path, model)?.motion);
    }
    let options = MotionOptions {
        skeleton_map: skeleton_map.map(str::to_owned),
        ..options()
    };
    let motion = read_motion_for(path, model, &options)?;
    Ok(MotionClip {
        name: name_of_file(path),
        rate_hz: motion.rate_hz,
        poses: motion.frames,
        suspect: Vec::new(),
    })
}

/// A file's name without its ending.
pub(crate) fn name_of_file(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

fn parse_skeleton(path: &Path) -> Result<LabelledClip, EvaluationError> {
    let file = cromosim_spatial::open_file(path).map_err(|source| EvaluationError::Read {
        path: path.to_owned(),
        source,
    })?;
    Ok(parse_skeleton_npz(file, &path.display().to_string())?)
}

fn on_body(
    clip: LabelledClip,
    path: &Path,
    model: &Arc<BodyModel>,
) -> Result<LabelledMotion, EvaluationError> {
    let LabelledClip {
        clip,
        mut suspect,
        mut labels,
        atypical,
        ..
    } = clip;
    let motion = retarget(&clip, model, &options())?;
    let begin = BLEND_FRAMES.min(motion.frames.len());
    suspect.drain(..begin.min(suspect.len()));
    labels.drain(..begin.min(labels.len()));
    let motion = MotionClip {
        name: name_of_file(path),
        rate_hz: motion.rate_hz,
        poses: motion.frames[begin..].to_vec(),
        suspect,
    };
    Ok(LabelledMotion {
        motion,
        labels,
        atypical,
    })
}

fn options() -> MotionOptions {
    MotionOptions {
        keep_lead_in: true,
        ..MotionOptions::default()
    }
}
