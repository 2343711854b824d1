//! EuRoC MAV / ASL files: `state_groundtruth_estimate0/data.csv` and `imu0/data.csv`. Stamps are
//! whole nanoseconds, a header begins with `#`.

use std::fmt::Write;

use nalgebra::Vector3;

use super::table::{by_commas, rows, text};
use super::{ImuSeries, PoseTrajectory, RigidError};

const TRUTH_HEADER: &str = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []";
const MORE_HEADER: &str = ", v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]";
const IMU_HEADER: &str = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]";

/// A body's ground truth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EurocGroundTruth {
    /// world_from_sensor.
    pub trajectory: PoseTrajectory,
    /// In the world, m/s; as long as the trajectory, or empty where the file has poses only.
    pub velocities: Vec<Vector3<f64>>,
    /// The gyroscope's bias, rad/s; as the velocities.
    pub gyroscope_biases: Vec<Vector3<f64>>,
    /// The accelerometer's bias, m/s2; as the velocities.
    pub accelerometer_biases: Vec<Vector3<f64>>,
}

/// Reads ground truth with 17 columns (stamp, p, q as w x y z, v, gyroscope's and accelerometer's
/// bias) or its first 8.
///
/// # Errors
/// [`RigidError::Columns`], [`RigidError::Value`], [`RigidError::Order`],
/// [`RigidError::Quaternion`], [`RigidError::Empty`].
pub fn parse_euroc_ground_truth(bytes: &[u8], name: &str) -> Result<EurocGroundTruth, RigidError> {
    let mut truth = EurocGroundTruth::default();
    let mut columns = None;
    for row in rows(text(bytes, name)?, name, by_commas) {
        let expected = *columns.get_or_insert(if row.cells.len() == 8 { 8 } else { 17 });
        row.expect_columns(
            |count| count == expected,
            if expected == 8 {
                "8 (as before)"
            } else {
                "17 (or 8: stamp, position, quaternion)"
            },
        )?;
        let stamp = row.stamp(0, 9)?;
        row.check_order(stamp, truth.trajectory.stamps.last())?;
        truth
            .trajectory
            .push(stamp, row.vector(1)?, row.rotation([5, 6, 7, 4])?);
        if expected == 17 {
            truth.velocities.push(row.vector(8)?);
            truth.gyroscope_biases.push(row.vector(11)?);
            truth.accelerometer_biases.push(row.vector(14)?);
        }
    }
    if truth.trajectory.stamps.is_empty() {
        Err(RigidError::Empty {
            name: name.to_owned(),
        })
    } else {
        Ok(truth)
    }
}

/// Writes ground truth: the inverse of [`parse_euroc_ground_truth`].
pub fn write_euroc_ground_truth(truth: &EurocGroundTruth) -> String {
    let count = truth.trajectory.stamps.len();
    let more = [
        &truth.velocities,
        &truth.gyroscope_biases,
        &truth.accelerometer_biases,
    ];
    let complete = more.iter().all(|list| list.len() == count);
    let mut content = format!(
        "{TRUTH_HEADER}{}\n",
        if complete { MORE_HEADER } else { "" }
    );
    let poses = truth
        .trajectory
        .stamps
        .iter()
        .zip(&truth.trajectory.positions)
        .zip(&truth.trajectory.rotations);
    for (index, ((stamp, p), q)) in poses.enumerate() {
        let _ = write!(
            content,
            "{},{},{},{},{},{},{},{}",
            stamp.nanos, p.x, p.y, p.z, q.w, q.i, q.j, q.k
        );
        if complete {
            for vector in more.iter().filter_map(|list| list.get(index)) {
                let _ = write!(content, ",{},{},{}", vector.x, vector.y, vector.z);
            }
        }
        content.push('\n');
    }
    content
}

/// Reads an IMU file: stamp, angular velocity (rad/s), specific force (m/s2).
///
/// # Errors
/// [`RigidError::Columns`], [`RigidError::Value`], [`RigidError::Order`], [`RigidError::Empty`].
pub fn parse_euroc_imu(bytes: &[u8], name: &str) -> Result<ImuSeries, RigidError> {
    let mut series = ImuSeries::default();
    for row in rows(text(bytes, name)?, name, by_commas) {
        row.expect_columns(
            |count| count == 7,
            "7 (stamp, angular velocity, specific force)",
        )?;
        let stamp = row.stamp(0, 9)?;
        row.check_order(stamp, series.stamps.last())?;
        series.push(stamp, row.vector(4)?, row.vector(1)?);
    }
    if series.stamps.is_empty() {
        Err(RigidError::Empty {
            name: name.to_owned(),
        })
    } else {
        Ok(series)
    }
}

/// Writes an IMU file: the inverse of [`parse_euroc_imu`].
pub fn write_euroc_imu(series: &ImuSeries) -> String {
    let mut content = format!("{IMU_HEADER}\n");
    for ((stamp, a), w) in series
        .stamps
        .iter()
        .zip(&series.specific_force)
        .zip(&series.angular_velocity)
    {
        let _ = writeln!(
            content,
            "{},{},{},{},{},{},{}",
            stamp.nanos, w.x, w.y, w.z, a.x, a.y, a.z
        );
    }
    content
}
