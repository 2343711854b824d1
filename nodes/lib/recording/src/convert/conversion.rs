//! What a conversion takes and gives.

use std::path::PathBuf;

use super::{ReadOptions, Target};

/// What becomes what.
#[derive(Clone, Debug)]
pub struct Conversion {
    /// The file or bag that is read.
    pub input: PathBuf,
    /// The file that is written.
    pub out: PathBuf,
    /// Its format.
    pub target: Target,
    /// How the input is read.
    pub options: ReadOptions,
    /// The IMU series (EuRoC, CSV) that was measured along a trajectory, for a bag.
    pub imu: Option<PathBuf>,
    /// Replaces `out` where it exists.
    pub replace: bool,
}

/// What a conversion wrote.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Converted {
    /// Whether the rows are frames of a motion.
    pub is_motion: bool,
    /// Frames or rows.
    pub count: usize,
    /// What was left out or changed, a line each.
    pub notes: Vec<String>,
}
