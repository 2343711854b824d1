//! Rigid bodies and their IMUs as plain text files: TUM trajectories, EuRoC/ASL ground truth and
//! IMU files, and tables of poses or readings with a header. So robots and props can carry virtual
//! IMUs, too.
//!
//! One file a format, each with a parser over bytes and a writer. Stamps are exact to the
//! nanosecond both ways, numbers are written with the fewest digits that give the same float64, so
//! that a file that was written here comes back bit for bit. Rows have to be in the order of time
//! without repeated stamps; quaternions may be off length 1 by a hundredth, as printed digits make
//! them, and are normalised where they are off by more than 1e-9.

mod content;
mod error;
mod euroc;
pub(crate) mod header;
mod imu_csv;
mod pose_csv;
mod series;
mod sniff;
pub(crate) mod table;
mod tum;

pub use content::{RigidContent, parse_rigid};
pub use error::RigidError;
pub use euroc::{
    EurocGroundTruth, parse_euroc_ground_truth, parse_euroc_imu, write_euroc_ground_truth,
    write_euroc_imu,
};
pub use imu_csv::{parse_imu_csv, write_imu_csv};
pub use pose_csv::{parse_pose_csv, write_pose_csv};
pub(crate) use series::median_rate;
pub use series::{ImuSeries, PoseTrajectory};
pub use sniff::{RigidFormat, sniff_rigid};
pub use table::unit_quaternion;
pub use tum::{parse_tum, write_tum};
