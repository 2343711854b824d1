//! Who wrote a file of poses, and what all formats have in common.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Frames of all people of a file together: nine hours at 30 Hz.
pub const MAX_POSES: usize = 1 << 20;
/// Video estimates do not say their frame rate; Hz.
pub const VIDEO_RATE_HZ: f64 = 30.0;

/// Who wrote a file of SMPL parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum PoseFormat {
    /// AMASS (Mahmood et al. 2019), the releases for SMPL, SMPL-H and SMPL-X, and MoSh++'s stage
    /// II.
    Amass,
    /// VIBE (Kocabas et al. 2020).
    Vibe,
    /// WHAM (Shin et al. 2024).
    Wham,
    /// GVHMR (Shen et al. 2024).
    Gvhmr,
    /// TRAM (Wang et al. 2024).
    Tram,
    /// PHALP (Rajasegaran et al. 2022), the tracker of 4D-Humans (Goel et al. 2023).
    Phalp,
    /// SLAHMR (Ye et al. 2023).
    Slahmr,
    /// DIP-IMU's reference poses (Huang et al. 2018).
    Dip,
}

impl PoseFormat {
    /// Whether it comes from video, and so knows neither the frame rate nor the floor.
    pub fn is_video(self) -> bool {
        !matches!(self, Self::Amass | Self::Dip)
    }
}

impl fmt::Display for PoseFormat {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Amass => "AMASS",
            Self::Vibe => "VIBE",
            Self::Wham => "WHAM",
            Self::Gvhmr => "GVHMR",
            Self::Tram => "TRAM",
            Self::Phalp => "PHALP",
            Self::Slahmr => "SLAHMR",
            Self::Dip => "DIP-IMU",
        })
    }
}

/// Which of its estimates is taken of a file that holds both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PoseView {
    /// The one in a world, where there is one.
    #[default]
    World,
    /// The one in the camera's axes.
    Camera,
}
