//! The formats that are written.

use std::path::Path;

use crate::RecordingError;

/// What can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// npz with AMASS' keys.
    Amass,
    /// BVH in SMPL's skeleton.
    Bvh,
    /// TRC: markers on the body.
    Trc,
    /// A TUM trajectory.
    Tum,
    /// EuRoC's ground truth, or its IMU file.
    Euroc,
    /// A table with a header: poses, or readings.
    Csv,
    /// Readings in columns (Parquet).
    Columns,
    /// rosbag2 MCAP.
    Bag,
}

impl Target {
    /// Every format.
    pub const ALL: [Self; 8] = [
        Self::Amass,
        Self::Bvh,
        Self::Trc,
        Self::Tum,
        Self::Euroc,
        Self::Csv,
        Self::Columns,
        Self::Bag,
    ];

    /// The format that the ending of a file's name stands for.
    ///
    /// # Errors
    /// [`RecordingError::UnknownEnding`].
    pub fn for_ending(out: &Path) -> Result<Self, RecordingError> {
        let ending = out
            .extension()
            .map(|ending| ending.to_string_lossy().to_ascii_lowercase())
            .unwrap_or_default();
        Ok(match ending.as_str() {
            "npz" => Self::Amass,
            "bvh" => Self::Bvh,
            "trc" => Self::Trc,
            "tum" | "txt" => Self::Tum,
            "csv" => Self::Csv,
            "parquet" => Self::Columns,
            "mcap" => Self::Bag,
            _ => {
                return Err(RecordingError::UnknownEnding {
                    path: out.to_owned(),
                });
            }
        })
    }

    /// Whether it holds whole bodies.
    pub const fn takes_motions(self) -> bool {
        matches!(self, Self::Amass | Self::Bvh | Self::Trc | Self::Bag)
    }

    /// What it is in a sentence, with the article.
    pub const fn describe(self) -> &'static str {
        match self {
            Self::Amass => "an npz with AMASS' keys",
            Self::Bvh => "a BVH file",
            Self::Trc => "a TRC file",
            Self::Tum => "a TUM trajectory",
            Self::Euroc => "a EuRoC file",
            Self::Csv => "a table",
            Self::Columns => "a Parquet file of readings",
            Self::Bag => "a bag",
        }
    }
}
