//! What can go wrong with a recording.

use std::path::PathBuf;

use cromosim_bag::BagError;
use cromosim_body::BodyError;
use cromosim_imu::ImuError;
use cromosim_motion::MotionError;
use cromosim_msgs::{NotABody, NotARotation};

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

impl RecordingError {
    /// The error behind the place where it happened.
    pub(crate) fn at(self, place: impl Into<String>) -> Self {
        Self::At {
            place: place.into(),
            source: Box::new(self),
        }
    }
}
