//! What can go wrong with a recording.

use cromosim_spatial::meant;
use std::path::PathBuf;

use cromosim_bag::BagError;
use cromosim_body::BodyError;
use cromosim_imu::{EffectError, ImuError};
use cromosim_learned::LearnedError;
use cromosim_motion::MotionError;
use cromosim_msgs::{NotABody, NotARotation};
use cromosim_spatial::SpatialError;

use crate::rigid::RigidError;

/// An error of this crate: one line that names the file, the place in it and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The operating system refuses a file.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// A file that does not fit into memory.
    #[error("{}: more than {most} bytes; cut the file into parts", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The largest size that is read, bytes.
        most: u64,
    },
    /// Nothing to write.
    #[error("{name}: no pose and no reading")]
    NothingRecorded {
        /// The file.
        name: String,
    },
    /// A bag without anything to compare IMUs with.
    #[error(
        "{}: the recording holds neither /reference/NAME (geometry_msgs/msg/PoseStamped) nor an attachment placements.yaml beside SMPL states; there is no reference",
        path.display()
    )]
    NoReference {
        /// The bag.
        path: PathBuf,
    },
    /// A namespace that has no recording, or the need to choose one.
    #[error("{}: {reason}", path.display())]
    Namespace {
        /// The bag.
        path: PathBuf,
        /// The namespaces that there are.
        reason: String,
    },
    /// A topic without messages.
    #[error("{}: {topic} holds no message", path.display())]
    NoMessage {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
    },
    /// A topic of poses that are all NaN or infinite.
    #[error(
        "{}, {topic}: no pose but NaN or infinite ones ({count} messages)",
        path.display()
    )]
    NoFinitePose {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// Messages on it.
        count: usize,
    },
    /// A pose whose orientation is no rotation.
    #[error("{}, {topic} at {seconds:.6} s: {source}", path.display())]
    Pose {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// Stamp of the message, s.
        seconds: f64,
        /// What is wrong with it.
        source: NotARotation,
    },
    /// Poses of another body than the one at hand.
    #[error(
        "{}: its poses are of the body {body}, not of the embedded one; give --body FILE",
        path.display()
    )]
    ForeignBody {
        /// The bag.
        path: PathBuf,
        /// Identifier of the body that the bag names.
        body: String,
    },
    /// A placement whose samples have no stamps.
    #[error(
        "{placement}: the recording has no /imu/{placement}/data_raw to take the stamps from; give --rate HZ"
    )]
    NoStamps {
        /// Its name.
        placement: String,
    },
    /// A reference that is too short or too irregular for the estimate of its motion.
    #[error(
        "the reference's motion cannot be estimated (--scheme spline does with two poses): {source}"
    )]
    NotEstimated {
        /// What is wrong with its poses.
        source: SpatialError,
    },
    /// A scheme together with a smoothing that only the estimate can undo.
    #[error("--scheme {scheme} cannot undo reference_smoothing; leave --scheme out")]
    CannotUndo {
        /// The scheme.
        scheme: String,
    },
    /// A part of a motion that nothing can be differentiated in.
    #[error("{name}: {frames} frame is no motion; at least 2 are needed")]
    NoMotion {
        /// The motion.
        name: String,
        /// Frames that are played.
        frames: usize,
    },
    /// Ends that leave nothing.
    #[error("--trim leaves nothing of the motion; give less")]
    AllTrimmed,
    /// Nothing says above which frequency texture is to be drawn.
    #[error(
        "{placement}: --texture needs a scheme that says up to which frequency it resolves the motion: adaptive_spline, spline or --bandwidth"
    )]
    NoBandwidth {
        /// The placement.
        placement: String,
    },
    /// Two sides of a comparison that share nothing.
    #[error("{what} in common: A has {a}; B has {b}")]
    NothingInCommon {
        /// Which sides, and what they lack.
        what: &'static str,
        /// Names that A has.
        a: String,
        /// Names that B has.
        b: String,
    },
    /// A file that is there already.
    #[error("{}: exists already; give another name, or --force to replace it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refuses a folder.
    #[error("{}: cannot be made: {source}", path.display())]
    Make {
        /// The folder.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// The operating system refuses to write.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// Two inputs whose outputs would have one name.
    #[error(
        "{} and {} would both become {name}; simulate them into two folders, or name the folder above them, whose subfolders are kept",
        files[0].display(), files[1].display()
    )]
    SameOutput {
        /// The inputs.
        files: [PathBuf; 2],
        /// The output's name without its ending.
        name: String,
    },
    /// Outputs that were made otherwise.
    #[error(
        "{}: its outputs were made with other settings ({key}: {there} there, {here} here); give another folder, or --force to write all anew",
        path.display()
    )]
    OtherSettings {
        /// The manifest.
        path: PathBuf,
        /// The first setting that differs.
        key: String,
        /// Its value in the manifest.
        there: String,
        /// As it is now.
        here: String,
    },
    /// Columns that cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    WriteColumns {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: parquet::errors::ParquetError,
    },
    /// The operating system refuses the place where samples are put aside.
    #[error("{}: samples cannot be put aside there: {source}", folder.display())]
    PutAside {
        /// The folder of the output.
        folder: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// A file, or a topic in it, that does not suit what is asked of it.
    #[error("{}: {problem}", path.display())]
    Unsuitable {
        /// The file, with the topic where it is a bag's.
        path: PathBuf,
        /// What it is, and what to do.
        problem: String,
    },
    /// A name that does not say which format to write.
    #[error(
        "{}: the ending does not say what to write (.npz, .bvh, .trc, .tum, .txt, .csv, .parquet or .mcap do); give --to",
        path.display()
    )]
    UnknownEnding {
        /// The file to write.
        path: PathBuf,
    },
    /// An IMU series for a file that cannot hold it beside a trajectory.
    #[error("--imu goes into a bag; OUT is {target}")]
    ImuBesideNoBag {
        /// What is written, with the article.
        target: &'static str,
    },
    /// An IMU series beside something else than a trajectory.
    #[error("--imu goes beside a trajectory, but {} is {content}", path.display())]
    ImuBesideNoTrajectory {
        /// The input.
        path: PathBuf,
        /// What it is, with the article.
        content: &'static str,
    },
    /// A part that begins before the recording.
    #[error("--start {start_s}: expected 0 or more seconds")]
    BadStart {
        /// As given, s.
        start_s: f64,
    },
    /// A part without length.
    #[error("--duration {duration_s}: expected a positive number of seconds")]
    BadDuration {
        /// As given, s.
        duration_s: f64,
    },
    /// A joint that SMPL does not have.
    #[error("--joint {name}: SMPL has no such joint; it has {}{}", known.join(", "), meant(name, known.iter().copied()))]
    UnknownJoint {
        /// As given.
        name: String,
        /// SMPL's names.
        known: Vec<&'static str>,
    },
    /// A site that the body does not have.
    #[error("--site {name}: {problem}")]
    Site {
        /// As given.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A placement's name that cannot be part of a topic.
    #[error("{option} {name}: {problem}")]
    PlacementName {
        /// The command line's option that gave it.
        option: &'static str,
        /// As given.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A frame of TF with two parents.
    #[error(
        "{}, {topic}: frame {frame} hangs on {} and on {}",
        path.display(), parents[0], parents[1]
    )]
    TwoParents {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The frame.
        frame: String,
        /// Its parents.
        parents: [String; 2],
    },
    /// A topic of readings that are all NaN or infinite.
    #[error("{}, {topic}: no finite reading ({count} messages)", path.display())]
    NoFiniteReading {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// Messages on it.
        count: usize,
    },
    /// An error with the place where it happened.
    #[error("{place}: {source}")]
    At {
        /// File and topic, or placement.
        place: String,
        /// The reason.
        source: Box<RecordingError>,
    },
    /// A bag.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A body or its betas.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A placement, or its kinematics.
    #[error(transparent)]
    Imu(#[from] ImuError),
    /// Effects that cannot be used.
    #[error(transparent)]
    Effect(Box<EffectError>),
    /// Networks or a mapping that cannot be used.
    #[error(transparent)]
    Learned(Box<LearnedError>),
    /// Stamps that cannot be used.
    #[error(transparent)]
    Spatial(#[from] SpatialError),
    /// A motion file.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A data set's file, a trajectory or a table of readings.
    #[error(transparent)]
    Rigid(#[from] RigidError),
    /// A message that holds no pose of a body.
    #[error(transparent)]
    Message(#[from] NotABody),
}

// Boxed, so that results stay small.
impl From<EffectError> for RecordingError {
    fn from(error: EffectError) -> Self {
        Self::Effect(Box::new(error))
    }
}

impl From<LearnedError> for RecordingError {
    fn from(error: LearnedError) -> Self {
        Self::Learned(Box::new(error))
    }
}

impl RecordingError {
    /// The error behind the place where it happened.
    pub(crate) fn at(self, place: impl Into<String>) -> Self {
        Self::At {
            place: place.into(),
            source: Box::new(self),
        }
    }
}
