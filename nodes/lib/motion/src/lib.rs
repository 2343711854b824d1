//! Motion files and the embedded walk, all in SMPL's joints.
//!
//! [`read_motion`] takes a file and finds out what it is by its content. Skeletons (BVH, ASF/AMC, MVNX)
//! are retargeted: a [`SmplMotion`] in a world with z up, feet on z = 0, with shape coefficients
//! fitted to the source's bones; the [`RetargetReport`] says how a source was understood. To
//! markers (C3D, TRC, tables of Motive and Vicon) a body is fitted, which stays on the recording's
//! floor; the [`MarkerReport`] says how well. [`embedded_walk`] is a motion without a file.
//!
//! Files of SMPL parameters (AMASS, and estimates from video: VIBE, WHAM, GVHMR, TRAM, PHALP,
//! SLAHMR) need no retargeting; the [`PoseReport`] says what was taken. Betas of another kind of
//! body than the one at hand are left out or fitted ([`ShapeChoice`]). [`read_people`] takes
//! several people of a file, or everybody; [`PoseFile::into_camera_poses`] leaves poses in the
//! camera's axes.
//!
//! ```
//! let walk = cromosim_motion::embedded_walk();
//! assert_eq!(walk.duration_s().round(), 10.0);
//! let halfway = walk.pose_at(5.0).expect("it has frames");
//! assert!(halfway.root_position.z > 0.5);
//! ```

mod amass_write;
mod amc;
mod asf;
mod axes;
mod bvh;
mod c3d;
mod error;
mod format;
mod marker_tables;
mod markers;
mod motion;
mod mvnx;
mod options;
mod plausibility;
mod poses;
mod read;
mod report;
mod retarget;
mod skeleton_draft;
mod skeleton_map;
mod text;
mod trc;
mod walk;

pub use amass_write::write_amass;
pub use amc::{AMC_RATE_HZ, parse_amc};
pub use asf::{AsfBone, AsfChannel, AsfSkeleton, parse_asf};
pub use axes::UpAxis;
pub use bvh::{BvhClip, BvhJoint, Channel, MAX_JOINTS, SkeletonPose, parse_bvh, write_bvh};
pub use c3d::parse_c3d;
pub use error::MotionError;
pub use format::MotionFormat;
pub use marker_tables::{VICON_SECTIONS, parse_motive_markers, parse_vicon_markers};
pub use markers::{
    MarkerClip, MarkerFit, MarkerOptions, MarkerReport, MarkerSet, MarkerSite, SetMarker,
    fit_markers, fit_rigid, place_markers,
};
pub use motion::{SmplMotion, continuous, slerp};
pub use mvnx::{Mvnx, parse_mvnx};
pub use options::{MotionOptions, RestChoice};
pub use poses::{
    CameraPoses, MAX_POSES, Person, PersonPart, PoseAxes, PoseFile, PoseFormat, PoseReport,
    PoseTrack, PoseView, RateOrigin, ShapeChoice, ShapeOrigin, VIDEO_RATE_HZ, open_poses,
    read_people, read_people_whole,
};
pub use read::{read_motion, read_motion_for, read_skeleton};
pub use report::RetargetReport;
pub use retarget::retarget;
pub use skeleton_draft::SkeletonDraft;
pub use skeleton_map::{FeetAtRest, Sides, SkeletonMap};
pub use trc::{parse_trc, write_trc};
pub use walk::embedded_walk;
