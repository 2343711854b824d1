//! Importers of the data sets that people have: TotalCapture, PAMAP2, RealWorld (HAR), BROAD,
//! smartphone and smartwatch, IMUs on segments with markers, columns of readings, and the structure
//! of DIP-IMU; and of what motion capture systems and sensors export: OptiTrack, Vicon, Movella DOT, MT
//! Manager, Xsens MVN. Each gives the IMUs by placement, and references where there are.
//!
//! [`open_dataset`] tells a file by its content and looks for what belongs to it. Parsers work over
//! bytes and open nothing. What a data set does not say (gyroscopes in DIP-IMU) is not made up.

mod broad;
mod capture;
mod columns;
mod dip;
mod har_spsw;
mod marked_imu;
mod marker_errors;
mod movella;
mod mvnx;
mod open;
mod optitrack;
mod pamap2;
mod realworld;
mod recording;
mod skeleton_npz;
mod totalcapture;
mod vicon;

/// Data sets give magnetic fields in microtesla.
const TESLA_PER_MICROTESLA: f64 = 1e-6;

pub use broad::parse_broad;
pub use columns::parse_columns;
pub use dip::{DIP_SENSORS, DipArray, DipRecording};
pub use har_spsw::{HAR_SPSW_RATE_HZ, parse_har_spsw};
pub use marked_imu::parse_marked_imu;
pub use movella::parse_movella;
pub use mvnx::parse_mvnx_sensors;
pub use open::{DatasetFiles, DatasetFormat, open_dataset, sniff_dataset};
pub use optitrack::parse_optitrack;
pub use pamap2::{PAMAP2_RATE_HZ, pamap2_activity, parse_pamap2};
pub use realworld::parse_realworld;
pub use recording::{ActivitySpan, DatasetRecording, PlacedImu};
pub use skeleton_npz::{LabelledClip, parse_skeleton_npz};
pub use totalcapture::{
    TOTALCAPTURE_RATE_HZ, parse_totalcapture_calibration, parse_totalcapture_reference,
    parse_totalcapture_sensors,
};
pub use vicon::parse_vicon;
