//! TotalCapture (Trumble et al. 2017): `*_Xsens_AuxFields.sensors`, `gt_skel_gbl_pos.txt`,
//! `gt_skel_gbl_ori.txt`, and the calibrations `*_calib_imu_ref.txt` and `*_calib_imu_bone.txt`.

use cromosim_body::Joint;
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

use super::{DatasetRecording, PlacedImu};
use crate::rigid::table::{Row, by_blanks, rows, text};
use crate::rigid::{PoseTrajectory, RigidError};

/// All its streams run at 60 Hz.
pub const TOTALCAPTURE_RATE_HZ: f64 = 60.0;
/// The data set has 13 sensors; a file that declares more than this has none of its own.
const MAX_SENSORS: usize = 100;
const MAX_JOINTS: usize = 200;
const METRES_PER_INCH: f64 = 0.0254;

/// Xsens gives the magnetic field in units of the earth's where the device was calibrated, which the files do
/// not say; taken as that of the data set's university, 51.2 N 0.6 W (WMM2020), to two digits.
const TESLA_PER_UNIT: f64 = 4.9e-5;

/// Reads a `.sensors` file: a line with the numbers of sensors and frames; per frame a line with
/// its number, and a line per sensor with its name, orientation (w x y z, world_from_sensor),
/// specific force (m/s2), angular velocity (rad/s) and magnetic field, in its own axes.
///
/// # Errors
/// [`RigidError::Columns`] (the plain `_Xsens.sensors` have no gyroscope: take
/// `_Xsens_AuxFields.sensors`), [`RigidError::Value`], [`RigidError::Quaternion`],
/// [`RigidError::Content`] where the frames are cut short.
pub fn parse_totalcapture_sensors(
    bytes: &[u8],
    name: &str,
) -> Result<DatasetRecording, RigidError> {
    let mut lines = rows(text(bytes, name)?, name, by_blanks);
    let head = lines.next().ok_or_else(|| RigidError::Empty {
        name: name.to_owned(),
    })?;
    head.expect_columns(|count| count == 2, "2 (sensors, frames)")?;
    let sensors = whole(&head, 0, MAX_SENSORS, "a number of sensors up to 100")?;
    let frames = whole(
        &head,
        1,
        bytes.len(),
        "a number of frames that the file has room for",
    )?;
    let mut recording = DatasetRecording {
        name: name.to_owned(),
        rate_hz: TOTALCAPTURE_RATE_HZ,
        ..DatasetRecording::default()
    };
    let cut = |frame: usize| RigidError::Content {
        name: name.to_owned(),
        place: format!("frame {frame}"),
        problem: format!(
            "the file ends here, but its first line says {frames} frames of {sensors} sensors"
        ),
    };
    for frame in 0..frames {
        let number = lines.next().ok_or_else(|| cut(frame + 1))?;
        number.expect_columns(|count| count == 1, "1 (the frame's number)")?;
        for sensor in 0..sensors {
            let row = lines.next().ok_or_else(|| cut(frame + 1))?;
            row.expect_columns(
                |count| count == 14,
                "14 (name, quaternion, acceleration, gyroscope, magnetometer: an AuxFields file)",
            )?;
            add(&mut recording, &row, frame, sensor)?;
        }
    }
    if frames == 0 || sensors == 0 {
        Err(RigidError::Empty {
            name: name.to_owned(),
        })
    } else {
        Ok(recording)
    }
}

fn add(
    recording: &mut DatasetRecording,
    row: &Row<'_>,
    frame: usize,
    sensor: usize,
) -> Result<(), RigidError> {
    let placement = row.cell(0)?;
    if frame == 0 {
        let segment = segment(placement);
        recording.imus.push(PlacedImu {
            placement: placement.to_owned(),
            segment,
            ..PlacedImu::default()
        });
    }
    let imu = recording
        .imus
        .get_mut(sensor)
        .filter(|imu| imu.placement == placement);
    let imu = imu.ok_or_else(|| row.error(0, "the sensors in the order of the first frame"))?;
    imu.world_from_sensor.push(row.rotation([2, 3, 4, 1])?);
    imu.series
        .push(stamp(frame), row.vector(5)?, row.vector(8)?);
    imu.magnetic_field.push(row.vector(11)? * TESLA_PER_UNIT);
    Ok(())
}

fn whole(row: &Row<'_>, column: usize, limit: usize, expected: &str) -> Result<usize, RigidError> {
    row.cell(column)?
        .parse()
        .ok()
        .filter(|number| *number <= limit)
        .ok_or_else(|| row.error(column, expected))
}

/// Frame numbers at 60 Hz, in whole nanoseconds.
fn stamp(frame: usize) -> Stamp {
    Stamp::from_nanos((frame as i64 * 1_000_000_000 + 30) / 60)
}

/// SMPL's segment of a sensor.
fn segment(placement: &str) -> Option<Joint> {
    Some(match placement {
        "Head" => Joint::Head,
        "Sternum" => Joint::Spine3,
        "Pelvis" => Joint::Pelvis,
        "L_UpArm" => Joint::LeftShoulder,
        "R_UpArm" => Joint::RightShoulder,
        "L_LowArm" => Joint::LeftElbow,
        "R_LowArm" => Joint::RightElbow,
        "L_UpLeg" => Joint::LeftHip,
        "R_UpLeg" => Joint::RightHip,
        "L_LowLeg" => Joint::LeftKnee,
        "R_LowLeg" => Joint::RightKnee,
        "L_Foot" => Joint::LeftAnkle,
        "R_Foot" => Joint::RightAnkle,
        _ => return None,
    })
}

/// The joint of the data set's skeleton that a sensor moves with.
pub(super) fn joint(placement: &str) -> Option<&'static str> {
    Some(match placement {
        "Head" => "Head",
        "Sternum" => "Spine3",
        "Pelvis" => "Hips",
        "L_UpArm" => "LeftArm",
        "R_UpArm" => "RightArm",
        "L_LowArm" => "LeftForeArm",
        "R_LowArm" => "RightForeArm",
        "L_UpLeg" => "LeftUpLeg",
        "R_UpLeg" => "RightUpLeg",
        "L_LowLeg" => "LeftLeg",
        "R_LowLeg" => "RightLeg",
        "L_Foot" => "LeftFoot",
        "R_Foot" => "RightFoot",
        _ => return None,
    })
}

/// Reads the skeleton's reference from its two files: a line with the joints' names, then per frame
/// x y z (inches, y up) or x y z w of each joint. Comes out in metres with z up, world_from_joint,
/// one trajectory a joint. The files may differ by the frames at their ends.
///
/// # Errors
/// [`RigidError::Columns`], [`RigidError::Value`], [`RigidError::Quaternion`],
/// [`RigidError::Header`] where the joints differ.
pub fn parse_totalcapture_reference(
    positions: &[u8],
    orientations: &[u8],
    names: [&str; 2],
) -> Result<Vec<(String, PoseTrajectory)>, RigidError> {
    let mut position_rows = rows(text(positions, names[0])?, names[0], by_blanks);
    let mut orientation_rows = rows(text(orientations, names[1])?, names[1], by_blanks);
    let empty = |name: &str| RigidError::Empty {
        name: name.to_owned(),
    };
    let head = position_rows.next().ok_or_else(|| empty(names[0]))?;
    let other = orientation_rows.next().ok_or_else(|| empty(names[1]))?;
    let mut joints = joints(&head, &other, names)?;
    let count = joints.len();
    let up = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    for (frame, (position, orientation)) in position_rows.zip(orientation_rows).enumerate() {
        position.expect_columns(
            |found| found == 3 * count,
            &format!("{} (3 per joint)", 3 * count),
        )?;
        orientation.expect_columns(
            |found| found == 4 * count,
            &format!("{} (4 per joint)", 4 * count),
        )?;
        for (index, (_, trajectory)) in joints.iter_mut().enumerate() {
            let [x, y, z, w] = std::array::from_fn(|part| 4 * index + part);
            let rotation = orientation.rotation([x, y, z, w])?;
            trajectory.push(
                stamp(frame),
                up * (position.vector(3 * index)? * METRES_PER_INCH),
                up * rotation,
            );
        }
    }
    if joints
        .iter()
        .all(|(_, trajectory)| trajectory.stamps.is_empty())
    {
        return Err(empty(names[0]));
    }
    Ok(joints)
}

/// The joints that both files name in their first line, each with a trajectory without poses.
fn joints(
    head: &Row<'_>,
    other: &Row<'_>,
    names: [&str; 2],
) -> Result<Vec<(String, PoseTrajectory)>, RigidError> {
    head.expect_columns(
        |count| (1..=MAX_JOINTS).contains(&count),
        "1 to 200 (the joints' names)",
    )?;
    if head.cells != other.cells {
        let missing = format!("joints of {}", names[0]);
        let found = other.cells.iter().map(|cell| (*cell).to_owned()).collect();
        return Err(RigidError::Header {
            name: names[1].to_owned(),
            line: other.line,
            missing,
            found,
        });
    }
    let trajectory = PoseTrajectory {
        frame: "world".to_owned(),
        ..PoseTrajectory::default()
    };
    let joints = head.cells.iter();
    Ok(joints
        .map(|joint| ((*joint).to_owned(), trajectory.clone()))
        .collect())
}

/// Reads a calibration: a line with the number of sensors, then per sensor its name and a
/// quaternion x y z w. In `_calib_imu_ref` these are reference_from_inertial, in `_calib_imu_bone`
/// bone_from_sensor inverted as the data set's notes use it: R_bone = R_ref R_imu R_bone_imu^-1.
///
/// # Errors
/// [`RigidError::Columns`], [`RigidError::Value`], [`RigidError::Quaternion`],
/// [`RigidError::Empty`].
pub fn parse_totalcapture_calibration(
    bytes: &[u8],
    name: &str,
) -> Result<Vec<(String, UnitQuaternion<f64>)>, RigidError> {
    let mut sensors = Vec::new();
    for row in rows(text(bytes, name)?, name, by_blanks).skip_while(|row| row.cells.len() == 1) {
        row.expect_columns(|count| count == 5, "5 (name, x y z w)")?;
        sensors.push((row.cell(0)?.to_owned(), row.rotation([1, 2, 3, 4])?));
    }
    if sensors.is_empty() {
        Err(RigidError::Empty {
            name: name.to_owned(),
        })
    } else {
        Ok(sensors)
    }
}
