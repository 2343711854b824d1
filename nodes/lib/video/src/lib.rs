//! From a video's estimates to motion in the world: poses that VIBE and its kind estimate in a
//! camera's axes get a global trajectory. The root comes from keypoints, depth maps and camera
//! parameters (the method of CROMOSim, Hao et al. 2022), with its uncertainty.
//!
//! [`global_trajectory`] takes the steps in order, each a pure function with a file of its own:
//! which person (`keypoints`), where in the image (`torso`), how far away (`surface`), how large a
//! unit is (`scale`), where in the world with which covariance (`observe`), the filter's noise
//! (`learn`), the smoothed track (`filter`), and which way is up (`ground`, `stand`).
//! [`CameraFolder`] finds the files of a shot; OpenPose's keypoints ([`parse_openpose`]), depth
//! maps ([`parse_depth`]) and cameras ([`parse_camera`]) are parsed from bytes.

mod clip;
mod depth_map;
mod error;
mod filter;
mod folder;
mod ground;
mod keypoints;
mod learn;
mod measurements;
mod observe;
mod openpose;
mod options;
mod parameters;
mod pinhole;
mod report;
mod scale;
mod source_poses;
mod stand;
mod surface;
mod torso;
mod trajectory;

pub use clip::{CameraClip, DepthProvider};
pub use depth_map::{DepthEncoding, DepthMap, parse_depth, parse_plain_depth};
pub use error::VideoError;
pub use filter::{FilterNoise, Measurement, RootState};
pub use folder::{CameraFolder, FolderDepth, FolderFrames, FolderLayout};
pub use keypoints::{BODY_25_COUNT, Keypoint, PersonKeypoints, track_person};
pub use openpose::parse_openpose;
pub use options::{Trajectory, TrajectoryOptions};
pub use parameters::parse_camera;
pub use pinhole::{Camera, CameraAxes};
pub use report::TrajectoryReport;
pub use scale::{ScaleEstimate, ScaleSource, standing_height};
pub use torso::{PelvisPixel, PelvisSource, pelvis_pixel};
pub use trajectory::{GlobalTrajectory, RootTrack, global_trajectory};
