//! RealWorld (HAR; Sztyler and Stuckenschmidt 2016): zips of `acc_ACTIVITY_POSITION.csv` and
//! `Gyroscope_ACTIVITY_POSITION.csv`, with columns `id,attr_time,attr_x,attr_y,attr_z`,
//! milliseconds since 1970.

use std::io::{Read, Seek};

use cromosim_body::Joint;
use cromosim_spatial::Stamp;
use nalgebra::Vector3;
use zip::ZipArchive;

use super::{DatasetRecording, PlacedImu};
use crate::rigid::RigidError;
use crate::rigid::table::{by_commas, rows, text};

/// Nominal rate of the phones, Hz.
const RATE_HZ: f64 = 50.0;
/// A position's table is about 3 MB.
const MAX_TABLE_BYTES: u64 = 32 << 20;
const MAX_TABLES: usize = 64;
/// Where the gyroscope is silent for longer, its readings are not interpolated.
const LONGEST_GAP_NS: i64 = 100_000_000;

/// Positions of the data set and SMPL's segment where the side does not matter.
const POSITIONS: [(&str, Option<Joint>); 7] = [
    ("chest", Some(Joint::Spine3)),
    ("forearm", None),
    ("head", Some(Joint::Head)),
    ("shin", None),
    ("thigh", None),
    ("upperarm", None),
    ("waist", Some(Joint::Pelvis)),
];

type Reading = (Stamp, Vector3<f64>);

/// Readings of one sensor; rows out of the order of time are left out and counted.
struct Table {
    position: &'static str,
    segment: Option<Joint>,
    activity: String,
    readings: Vec<Reading>,
    rows_left_out: usize,
}

/// Reads one activity of one person from its two zips, accelerometer and gyroscope. Both sensors
/// have stamps of their own: the gyroscope is interpolated linearly to the accelerometer's stamps,
/// and readings without gyroscope within 0.1 s around are left out.
///
/// # Errors
/// [`RigidError::Content`] for a damaged zip or one without positions, and those of the tables.
pub fn parse_realworld<R: Read + Seek>(
    accelerometer: R,
    gyroscope: R,
    names: [&str; 2],
) -> Result<DatasetRecording, RigidError> {
    let accelerations = tables(accelerometer, names[0])?;
    let turns = tables(gyroscope, names[1])?;
    let mut recording = DatasetRecording {
        name: names[0].to_owned(),
        rate_hz: RATE_HZ,
        ..DatasetRecording::default()
    };
    for table in accelerations {
        let Some(turn) = turns.iter().find(|turn| turn.position == table.position) else {
            continue;
        };
        let mut imu = PlacedImu {
            placement: table.position.to_owned(),
            segment: table.segment,
            ..PlacedImu::default()
        };
        imu.rows_left_out = table.rows_left_out + turn.rows_left_out;
        let mut after = 0;
        for (stamp, specific_force) in &table.readings {
            while turn
                .readings
                .get(after)
                .is_some_and(|(other, _)| other < stamp)
            {
                after += 1;
            }
            match interpolated(&turn.readings, after, *stamp) {
                Some(angular_velocity) => {
                    imu.series.push(*stamp, *specific_force, angular_velocity)
                }
                None => imu.rows_left_out += 1,
            }
        }
        if let (Some(first), Some(last)) = (imu.series.stamps.first(), imu.series.stamps.last()) {
            if recording.imus.is_empty() {
                recording.mark(*first, &table.activity);
                recording.mark(*last, &table.activity);
            }
            recording.imus.push(imu);
        }
    }
    if recording.imus.is_empty() {
        let problem =
            "no position has both an accelerometer and a gyroscope over the same time".to_owned();
        return Err(RigidError::Content {
            name: names[0].to_owned(),
            place: "zip".to_owned(),
            problem,
        });
    }
    Ok(recording)
}

/// Whether a zip holds tables of the data set.
pub(super) fn is_realworld(reader: impl Read + Seek) -> bool {
    let Ok(archive) = ZipArchive::new(reader) else {
        return false;
    };
    archive.file_names().filter_map(Result::ok).any(|member| {
        let file = member.rsplit('/').next().unwrap_or_default().to_lowercase();
        file.ends_with(".csv") && (file.starts_with("acc_") || file.starts_with("gyroscope_"))
    })
}

/// Between the readings before and at `after`.
fn interpolated(readings: &[Reading], after: usize, stamp: Stamp) -> Option<Vector3<f64>> {
    let (to, later) = readings.get(after)?;
    if *to == stamp {
        return Some(*later);
    }
    let (from, earlier) = readings.get(after.checked_sub(1)?)?;
    let gap = to
        .nanos
        .checked_sub(from.nanos)
        .filter(|gap| *gap <= LONGEST_GAP_NS)?;
    Some(earlier.lerp(later, (stamp.nanos - from.nanos) as f64 / gap as f64))
}

/// A member's bytes; what is wrong with it where it cannot be read or is too large.
fn unpacked<R: Read + Seek>(archive: &mut ZipArchive<R>, member: &str) -> Result<Vec<u8>, String> {
    let entry = archive.by_name(member).map_err(|error| error.to_string())?;
    let mut bytes = Vec::new();
    entry
        .take(MAX_TABLE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| error.to_string())?;
    if bytes.len() as u64 > MAX_TABLE_BYTES {
        return Err(format!("more than {MAX_TABLE_BYTES} bytes"));
    }
    Ok(bytes)
}

/// The archive's tables, one for each position on the body, in the order of positions.
fn tables<R: Read + Seek>(reader: R, name: &str) -> Result<Vec<Table>, RigidError> {
    let problem = |place: &str, problem: String| RigidError::Content {
        name: name.to_owned(),
        place: place.to_owned(),
        problem,
    };
    let mut archive = ZipArchive::new(reader).map_err(|error| problem("zip", error.to_string()))?;
    let members: Vec<String> = archive
        .file_names()
        .filter_map(Result::ok)
        .filter(|member| member.ends_with(".csv"))
        .map(std::borrow::Cow::into_owned)
        .collect();
    if members.len() > MAX_TABLES {
        return Err(problem(
            "zip",
            format!("{} tables, expected up to {MAX_TABLES}", members.len()),
        ));
    }
    let mut tables = Vec::new();
    for member in members {
        let stem = member.trim_end_matches(".csv").to_lowercase();
        let Some((position, segment)) = POSITIONS
            .iter()
            .find(|(position, _)| stem.ends_with(position))
        else {
            continue;
        };
        // One table a position: what else matches is a copy.
        if tables
            .iter()
            .any(|table: &Table| table.position == *position)
        {
            continue;
        }
        let bytes = unpacked(&mut archive, &member).map_err(|text| problem(&member, text))?;
        let file = stem.rsplit('/').next().unwrap_or_default();
        let activity = file.split('_').nth(1).unwrap_or_default().to_owned();
        let (readings, rows_left_out) = readings(&bytes, &format!("{name}/{member}"))?;
        tables.push(Table {
            position,
            segment: *segment,
            activity,
            readings,
            rows_left_out,
        });
    }
    tables.sort_by_key(|table| table.position);
    Ok(tables)
}

/// A table's readings, and how many rows were left out for their stamps.
fn readings(bytes: &[u8], name: &str) -> Result<(Vec<Reading>, usize), RigidError> {
    let mut readings: Vec<Reading> = Vec::new();
    let mut left_out = 0;
    let mut lines = rows(text(bytes, name)?, name, by_commas);
    if let Some(head) = lines.next()
        && head.cells != ["id", "attr_time", "attr_x", "attr_y", "attr_z"]
    {
        let found = head.cells.iter().map(|cell| (*cell).to_owned()).collect();
        return Err(RigidError::Header {
            name: name.to_owned(),
            line: head.line,
            missing: "id, attr_time, attr_x, attr_y, attr_z".to_owned(),
            found,
        });
    }
    for row in lines {
        row.expect_columns(|count| count == 5, "5 (id, time, x, y, z)")?;
        let stamp = row.stamp(1, 3)?;
        // Phones repeat stamps now and then.
        if readings
            .last()
            .is_some_and(|(previous, _)| *previous >= stamp)
        {
            left_out += 1;
            continue;
        }
        readings.push((stamp, row.vector(2)?));
    }
    Ok((readings, left_out))
}
