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
mod format;
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

pub use body::CameraPoses;
pub use file::PoseFile;
pub use format::{MAX_POSES, PoseFormat, PoseView, VIDEO_RATE_HZ};
pub use io::open_poses;
pub(crate) use io::read_poses;
pub use people::{Person, PersonPart, read_people, read_people_whole};
pub use report::{PoseReport, RateOrigin, ShapeOrigin};
pub use shape::ShapeChoice;
pub(crate) use shape::skeleton_betas;
pub use track::{PoseAxes, PoseTrack};
