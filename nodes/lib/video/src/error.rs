//! What can go wrong with a camera-space estimate.

use std::io;
use std::path::PathBuf;

use cromosim_arrays::ArraysError;
use cromosim_body::BodyError;

/// An error of this crate: one line that names the file, the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VideoError {
    /// A file or folder cannot be read.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// A file is larger than such files are.
    #[error("{name}: {bytes} bytes, more than the {limit} that are read")]
    TooLarge {
        /// The file.
        name: String,
        /// Its size.
        bytes: u64,
        /// The largest allowed.
        limit: u64,
    },
    /// Keypoints that are no JSON of OpenPose.
    #[error("{name}: not OpenPose keypoints: {problem}")]
    Json {
        /// The file.
        name: String,
        /// The reason, with line and column.
        problem: String,
    },
    /// A person's keypoints are not those of BODY_25.
    #[error(
        "{name}: people[{person}].pose_keypoints_2d: {problem}; run OpenPose with --model_pose BODY_25"
    )]
    Keypoints {
        /// The file.
        name: String,
        /// Index among the file's people.
        person: usize,
        /// What is wrong.
        problem: String,
    },
    /// A depth map that is not in the expected form.
    #[error("{name}, byte {offset}: {problem}")]
    Depth {
        /// The file.
        name: String,
        /// Where.
        offset: usize,
        /// What is wrong and what fits.
        problem: String,
    },
    /// A PNG that is no depth map.
    #[error("{name}: {problem}; a depth map in PNG is grey with 16 bits, in millimetres")]
    Png {
        /// The file.
        name: String,
        /// What is wrong.
        problem: String,
    },
    /// Camera parameters that are no camera.
    #[error("{name}: key {key}: {problem}")]
    Parameters {
        /// The file.
        name: String,
        /// The array.
        key: String,
        /// What is wrong and what fits.
        problem: String,
    },
    /// The parts of a clip differ in length.
    #[error("{name}: {what} of {found} frames, but poses of {expected}; give one for each frame")]
    Length {
        /// The clip.
        name: String,
        /// Which part.
        what: &'static str,
        /// Frames of the poses.
        expected: usize,
        /// Frames of the part.
        found: usize,
    },
    /// A number that is not finite or outside its range.
    #[error("{name}: {what} is {value}, expected {expected}")]
    Value {
        /// The clip or setting's owner.
        name: String,
        /// Which quantity, with its frame.
        what: String,
        /// What was given.
        value: f64,
        /// What fits.
        expected: &'static str,
    },
    /// Too few frames show the pelvis.
    #[error(
        "{name}: {found} of {frames} frames show the pelvis with keypoints and depth, {needed} are needed; lower least_confidence, or take trajectory: none"
    )]
    TooFewFrames {
        /// The clip.
        name: String,
        /// Usable frames.
        found: usize,
        /// All frames.
        frames: usize,
        /// The least number.
        needed: usize,
    },
    /// The scale cannot be told.
    #[error("{name}: no scale: {problem}; give scale as a factor")]
    Scale {
        /// The clip.
        name: String,
        /// Why.
        problem: String,
    },
    /// The up direction cannot be told.
    #[error("{name}: no up direction: {problem}; give gravity as a direction")]
    Gravity {
        /// The clip.
        name: String,
        /// Why.
        problem: String,
    },
    /// A folder has no frames.
    #[error("{}: no {expected} found; name the folder of such files", path.display())]
    NoFrames {
        /// The folder.
        path: PathBuf,
        /// Which files.
        expected: &'static str,
    },
    /// An array or its archive refuses.
    #[error(transparent)]
    Arrays(#[from] ArraysError),
    /// The body refuses.
    #[error(transparent)]
    Body(#[from] BodyError),
}
