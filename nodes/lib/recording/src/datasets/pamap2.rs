//! PAMAP2 (Reiss and Stricker 2012): `subjectNNN.dat`, 54 columns between blanks at 100 Hz.

use cromosim_body::Joint;

use super::{DatasetRecording, PlacedImu, TESLA_PER_MICROTESLA};
use crate::rigid::RigidError;
use crate::rigid::table::{Row, by_blanks, rows, text};

/// The IMUs' rate, Hz.
pub const PAMAP2_RATE_HZ: f64 = 100.0;
/// Placements and their first column (0-based): temperature, acceleration of 16 g (3) and of 6 g
/// (3), gyroscope (3), magnetometer (3), and four of an orientation that the data set calls
/// invalid. Hand and ankle are those of the dominant side, which the file does not name.
const IMUS: [(&str, usize, Option<Joint>); 3] = [
    ("hand", 3, None),
    ("chest", 20, Some(Joint::Spine3)),
    ("ankle", 37, None),
];

/// Reads a recording: time (s), activity, heart rate, and three IMUs. The accelerometer of 16 g is
/// taken, as the data set advises (the one of 6 g saturates); m/s2, rad/s, microtesla. Rows in
/// which an IMU lost its packet (NaN) are left out of its series.
///
/// # Errors
/// [`RigidError::Columns`], [`RigidError::Value`], [`RigidError::Order`], [`RigidError::Empty`].
pub fn parse_pamap2(bytes: &[u8], name: &str) -> Result<DatasetRecording, RigidError> {
    let mut recording = DatasetRecording {
        name: name.to_owned(),
        rate_hz: PAMAP2_RATE_HZ,
        ..DatasetRecording::default()
    };
    recording.imus = IMUS
        .iter()
        .map(|(placement, _, segment)| PlacedImu {
            placement: (*placement).to_owned(),
            segment: *segment,
            ..PlacedImu::default()
        })
        .collect();
    let mut previous = None;
    for row in rows(text(bytes, name)?, name, by_blanks) {
        row.expect_columns(
            |count| count == 54,
            "54 (time, activity, heart rate, 17 of each IMU)",
        )?;
        let stamp = row.stamp(0, 0)?;
        row.check_order(stamp, previous.as_ref())?;
        previous = Some(stamp);
        let activity = row
            .cell(1)?
            .parse()
            .ok()
            .and_then(pamap2_activity)
            .ok_or_else(|| row.error(1, "an activity of PAMAP2"))?;
        recording.mark(stamp, activity);
        for (imu, (_, first, _)) in recording.imus.iter_mut().zip(IMUS) {
            match (
                vector(&row, first + 1)?,
                vector(&row, first + 7)?,
                vector(&row, first + 10)?,
            ) {
                (Some(specific_force), Some(angular_velocity), Some(magnetic_field)) => {
                    imu.series.push(stamp, specific_force, angular_velocity);
                    imu.magnetic_field
                        .push(magnetic_field * TESLA_PER_MICROTESLA);
                }
                _ => imu.rows_left_out += 1,
            }
        }
    }
    if previous.is_none() {
        Err(RigidError::Empty {
            name: name.to_owned(),
        })
    } else {
        Ok(recording)
    }
}

fn vector(row: &Row<'_>, column: usize) -> Result<Option<nalgebra::Vector3<f64>>, RigidError> {
    let parts = [
        row.number_or_nan(column)?,
        row.number_or_nan(column + 1)?,
        row.number_or_nan(column + 2)?,
    ];
    Ok(if let [Some(x), Some(y), Some(z)] = parts {
        Some(nalgebra::Vector3::new(x, y, z))
    } else {
        None
    })
}

/// The name of an activity's number; `None` where there is no such number.
pub fn pamap2_activity(number: u32) -> Option<&'static str> {
    Some(match number {
        0 => "transient",
        1 => "lying",
        2 => "sitting",
        3 => "standing",
        4 => "walking",
        5 => "running",
        6 => "cycling",
        7 => "nordic_walking",
        9 => "watching_tv",
        10 => "computer_work",
        11 => "car_driving",
        12 => "ascending_stairs",
        13 => "descending_stairs",
        16 => "vacuum_cleaning",
        17 => "ironing",
        18 => "folding_laundry",
        19 => "house_cleaning",
        20 => "playing_soccer",
        24 => "rope_jumping",
        _ => return None,
    })
}
