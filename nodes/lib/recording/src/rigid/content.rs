//! Any of the formats of rigid bodies.

use super::{
    EurocGroundTruth, ImuSeries, RigidError, RigidFormat, parse_euroc_ground_truth,
    parse_euroc_imu, parse_imu_csv, parse_pose_csv, parse_tum, sniff_rigid,
};

/// What a file of a rigid body holds.
#[derive(Clone, Debug, PartialEq)]
pub enum RigidContent {
    /// Poses; of EuRoC's ground truth with the velocities and biases beside them.
    Poses(EurocGroundTruth),
    /// Readings of an IMU.
    Imu(ImuSeries),
}

/// Parses TUM, EuRoC and tables with a header, told by their content; `None` for anything else.
/// `name` stands in messages.
///
/// # Errors
/// What is wrong with the file, with its line.
pub fn parse_rigid(bytes: &[u8], name: &str) -> Result<Option<RigidContent>, RigidError> {
    let poses = |trajectory| {
        RigidContent::Poses(EurocGroundTruth {
            trajectory,
            ..EurocGroundTruth::default()
        })
    };
    let Some(format) = sniff_rigid(bytes) else {
        return Ok(None);
    };
    Ok(Some(match format {
        RigidFormat::Tum => poses(parse_tum(bytes, name)?),
        RigidFormat::PoseCsv => poses(parse_pose_csv(bytes, name)?),
        RigidFormat::EurocGroundTruth => {
            RigidContent::Poses(parse_euroc_ground_truth(bytes, name)?)
        }
        RigidFormat::EurocImu => RigidContent::Imu(parse_euroc_imu(bytes, name)?),
        RigidFormat::ImuCsv => RigidContent::Imu(parse_imu_csv(bytes, name)?),
    }))
}
