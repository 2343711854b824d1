//! What a file holds, and what of it was read.

use cromosim_motion::SmplMotion;

use crate::datasets::DatasetRecording;
use crate::rigid::{EurocGroundTruth, ImuSeries};

/// What a file holds, whatever its format.
#[derive(Clone, Debug)]
pub enum Content {
    /// The motion of a body.
    Motion(Box<SmplMotion>),
    /// The trajectory of a rigid body.
    Poses(EurocGroundTruth),
    /// The readings of one IMU.
    Imu(ImuSeries),
    /// Several IMUs with their references, or references alone.
    Recording(Box<DatasetRecording>),
}

impl Content {
    /// Its kind in words, with the article.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Motion(_) => "a motion",
            Self::Poses(_) => "a trajectory",
            Self::Imu(_) => "an IMU series",
            Self::Recording(_) => "a recording",
        }
    }

    /// Frames of a motion, else rows; of a recording those of all IMUs together, or of all references
    /// where it has no IMU.
    pub fn count(&self) -> usize {
        match self {
            Self::Motion(motion) => motion.frames.len(),
            Self::Poses(poses) => poses.trajectory.stamps.len(),
            Self::Imu(series) => series.stamps.len(),
            Self::Recording(recording) if recording.imus.is_empty() => {
                let references = recording.references.iter();
                references.map(|(_, poses)| poses.stamps.len()).sum()
            }
            Self::Recording(recording) => {
                let imus = recording.imus.iter();
                imus.map(|imu| imu.series.stamps.len()).sum()
            }
        }
    }
}

/// What was read.
#[derive(Clone, Debug)]
pub struct Read {
    /// What the file holds.
    pub content: Content,
    /// What was left out or changed, a line each.
    pub notes: Vec<String>,
}

impl From<Content> for Read {
    fn from(content: Content) -> Self {
        Self {
            content,
            notes: Vec::new(),
        }
    }
}
