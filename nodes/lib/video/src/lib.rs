//! From a video's estimates to motion in the world: poses that VIBE and its kind estimate in a
//! camera's axes get a global trajectory. The root comes from keypoints, depth maps and camera
//! parameters (the method of CROMOSim, Hao et al. 2022), with its uncertainty.
//!
//! The steps are pure functions: [`track_person`] (who), [`pelvis_pixel`] (where in the image),
//! [`surface_depth`] and [`PelvisSkin`] (how far), [`position_by_keypoints`], [`scale_of_frame`],
//! [`scale_of_object`] and [`combined_scale`] (metres), [`measure`] (where in the world, with its
//! covariance), [`learn_noise`], [`kalman_filter`] and [`FilterRun::smoothed`] (the track),
//! [`floor_normal`] and [`upright`] (gravity). [`global_trajectory`] does them in order. Readers of
//! OpenPose's keypoints, depth maps and camera parameters stand beside them; [`CameraFolder`] finds
//! their files.

mod clip;
mod depth_map;
mod error;
mod filter;
mod folder;
mod ground;
mod keypoints;
mod learn;
mod observe;
mod openpose;
mod parameters;
mod pinhole;
mod placed;
mod report;
mod scale;
mod stand;
mod surface;
mod torso;
mod trajectory;

pub use clip::{CameraClip, DepthProvider, average_betas};
pub use cromosim_spatial::{HALF_CONFIDENCE_STD_M, confidence_of_std, std_of_confidence};
pub use depth_map::{
    DepthEncoding, DepthMap, MAX_DEPTH_PIXELS, parse_depth, parse_npy_depth, parse_plain_depth,
    parse_png_depth, parse_raw_depth, write_raw_depth,
};
pub use error::CameraError;
pub use filter::{FilterNoise, FilterRun, GATE, Gate, Measurement, RootState, kalman_filter};
pub use folder::{CameraFolder, FolderDepth, FolderFrames, FolderLayout};
pub use ground::{Gravity, Soles, UpHints, floor_height, floor_normal, upright};
pub use keypoints::{BODY_25_COUNT, Keypoint, PersonKeypoints, track_person};
pub use learn::learn_noise;
pub use observe::{ObservedBody, RootObservation, measure, observe};
pub use openpose::{parse_openpose, write_openpose};
pub use parameters::parse_camera;
pub use pinhole::{Camera, CameraAxes};
pub use report::TrajectoryReport;
pub use scale::{
    ObjectLength, ScaleEstimate, ScaleSource, combined_scale, position_by_keypoints,
    scale_of_frame, scale_of_object, standing_height,
};
pub use surface::{PelvisSkin, PosedHips, SurfaceDepth, surface_depth};
pub use torso::{PelvisPixel, PelvisSource, pelvis_pixel};
pub use trajectory::{
    GlobalTrajectory, RootTrack, Trajectory, TrajectoryOptions, global_trajectory,
};
