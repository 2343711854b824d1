//! Files of SMPL parameters: AMASS, and what estimators from video write.
//!
//! A file is recognised by its keys ([`PoseFormat`]), whatever packs it (npz, pickle, joblib,
//! torch, npy). Each format has a file here that turns it into [`PoseTrack`]s, one a person: SMPL's
//! 24 rotations per frame and `trans`, in the file's own axes. A track becomes a
//! [`SmplMotion`](crate::SmplMotion) on a body in a world with z up ([`PoseFile::into_motion`]), or
//! stays in camera axes ([`PoseFile::into_camera_poses`]).
//!
//! | format | keys | axes | person |
//! |---|---|---|---|
//! | AMASS | `poses` or `fullpose` or `root_orient` + `pose_body`, `trans` | z up | one |
//! | VIBE | person: `pose` | camera | several |
//! | WHAM | person: `pose_world`, `trans_world` | y up | several |
//! | GVHMR | `smpl_params_global` | y up | one |
//! | TRAM | `pred_rotmat`; `world_cam_R`, `world_cam_T` beside it | found; camera without those | one |
//! | PHALP (4D-Humans) | frame: `tid`, `smpl` | camera | several |
//! | SLAHMR | `root_orient`, `pose_body`, `trans`, `cam_R` | of `floor_plane`, else found | several |
//! | DIP-IMU | `gt`, `imu_ori`, `imu_acc` | found | one |
//!
//! Camera axes are x right, y down, z forward.

mod amass;
mod body;
mod bridge;
mod dip;
mod file;
mod gvhmr;
mod io;
mod people;
mod phalp;
mod report;
mod shape;
mod slahmr;
mod track;
mod tram;
mod values;
mod vibe;
mod wham;

use std::fmt;

pub use body::CameraPoses;
pub use file::{PoseFile, PoseView};
pub(crate) use io::read_poses;
pub use io::{open_poses, read_camera_poses};
pub use people::{Person, read_people};
pub use report::{PoseReport, RateOrigin, ShapeOrigin};
pub use shape::ShapeChoice;
pub(crate) use shape::skeleton_betas;
pub use track::{PoseAxes, PoseTrack};

/// Frames of all people of a file together: nine hours at 30 Hz.
pub const MAX_POSES: usize = 1 << 20;
/// Video estimates do not say their frame rate; Hz.
pub const VIDEO_RATE_HZ: f64 = 30.0;

/// Who wrote a file of SMPL parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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
