//! Smartphone and smartwatch (Matey-Sanz, Casteleyn, Granell 2023, Data in Brief 109809), as npz:
//! one person a file, and for each execution `YY` and device `D` (`sp` the phone, `sw` the watch)
//! the arrays `YY_D__acc` (N, 3) m/s2, `YY_D__gyr` (N, 3) rad/s, `YY_D__t_ms` (N) and `YY_D__label`
//! (N).
//!
//! Executions follow each other in time, so that they are one recording with gaps. Phones repeat
//! stamps: of readings with the same stamp the first is kept.

use std::collections::BTreeSet;
use std::io::{Read, Seek};
use std::path::Path;

use cromosim_arrays::{Limits, NpzReader};
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use super::{ActivitySpan, DatasetRecording, PlacedImu};
use crate::rigid::RigidError;

/// Both devices' nominal rate, Hz.
pub const HAR_SPSW_RATE_HZ: f64 = 102.0;
/// One person takes a hundredth of it.
const LIMITS: Limits = Limits {
    decoded_bytes: 64 << 20,
    opcodes: 10_000,
    depth: 10,
};
/// Devices and where they are worn. The side is not said.
const DEVICES: [(&str, &str); 2] = [("sp", "pocket"), ("sw", "wrist")];

/// `YY` of a key `YY_sp__acc` or `YY_sw__acc`.
fn execution(key: &str) -> Option<&str> {
    let (name, _) = DEVICES.iter().find_map(|(device, _)| {
        Some((
            key.strip_suffix("__acc")?
                .strip_suffix(device)?
                .strip_suffix('_')?,
            device,
        ))
    })?;
    (!name.is_empty() && name.bytes().all(|byte| byte.is_ascii_digit())).then_some(name)
}

/// Whether these are the keys of a person's file.
pub(super) fn is_har_spsw(keys: &[String]) -> bool {
    keys.iter().any(|key| execution(key).is_some())
}

/// Reads a person: the phone in a trouser pocket (`pocket`) and the watch (`wrist`). What was done
/// is what the phone's labels say, the watch's where an execution has no phone; spans end with
/// their execution.
///
/// # Errors
/// [`RigidError::Arrays`], [`RigidError::Content`]; both name the array.
pub fn parse_har_spsw<R: Read + Seek>(
    reader: R,
    name: &str,
) -> Result<DatasetRecording, RigidError> {
    let mut npz = NpzReader::with_limits(reader, Path::new(name), LIMITS)?;
    let keys: BTreeSet<String> = npz.keys().into_iter().collect();
    let mut executions: Vec<&str> = keys.iter().filter_map(|key| execution(key)).collect();
    // Numbers of different lengths would not sort as text.
    executions.sort_by_key(|name| (name.len(), *name));
    executions.dedup();
    let mut recording = DatasetRecording {
        name: name.to_owned(),
        rate_hz: HAR_SPSW_RATE_HZ,
        ..DatasetRecording::default()
    };
    recording.imus = DEVICES
        .map(|(_, placement)| PlacedImu {
            placement: placement.to_owned(),
            ..PlacedImu::default()
        })
        .to_vec();
    for number in executions {
        let mut spans = None;
        for ((device, _), imu) in DEVICES.iter().zip(&mut recording.imus) {
            let prefix = format!("{number}_{device}__");
            if keys.contains(&format!("{prefix}acc")) {
                let found = read_device(&mut npz, name, &prefix, imu)?;
                spans.get_or_insert(found);
            }
        }
        recording.activities.extend(spans.unwrap_or_default());
    }
    recording.imus.retain(|imu| !imu.series.stamps.is_empty());
    if recording.imus.is_empty() {
        return Err(RigidError::Empty {
            name: name.to_owned(),
        });
    }
    Ok(recording)
}

/// Adds one execution's readings to the IMU; returns its activities.
fn read_device<R: Read + Seek>(
    npz: &mut NpzReader<R>,
    name: &str,
    prefix: &str,
    imu: &mut PlacedImu,
) -> Result<Vec<ActivitySpan>, RigidError> {
    let rows = Rows::read(npz, name, prefix)?;
    let mut spans: Vec<ActivitySpan> = Vec::new();
    for (row, (milliseconds, label)) in rows.times_ms.iter().zip(rows.labels).enumerate() {
        let Some(nanos) = milliseconds.checked_mul(1_000_000) else {
            let problem = format!("row {row} is {milliseconds}, expected milliseconds since 1970");
            return Err(RigidError::Content {
                name: name.to_owned(),
                place: format!("{prefix}t_ms"),
                problem,
            });
        };
        let stamp = Stamp::from_nanos(nanos);
        let last = imu.series.stamps.last();
        if last.is_some_and(|previous| *previous >= stamp) {
            imu.rows_left_out += 1;
            continue;
        }
        imu.series
            .push(stamp, rows.specific_force[row], rows.angular_velocity[row]);
        match spans.last_mut().filter(|span| span.activity == label) {
            Some(span) => span.end = stamp,
            None => spans.push(ActivitySpan {
                start: stamp,
                end: stamp,
                activity: label,
            }),
        }
    }
    Ok(spans)
}

/// One device's arrays of one execution, of equal length.
struct Rows {
    /// m/s2.
    specific_force: Vec<Vector3<f64>>,
    /// rad/s.
    angular_velocity: Vec<Vector3<f64>>,
    /// Milliseconds since 1970.
    times_ms: Vec<i64>,
    labels: Vec<String>,
}

impl Rows {
    fn read<R: Read + Seek>(
        npz: &mut NpzReader<R>,
        name: &str,
        prefix: &str,
    ) -> Result<Self, RigidError> {
        let key = |array: &str| format!("{prefix}{array}");
        let mut vectors = |array: &str| -> Result<Vec<Vector3<f64>>, RigidError> {
            let array = npz.at(&key(array))?.floats(&[None, Some(3)], "(N, 3)")?;
            let vectors = array.values.as_chunks::<3>().0.iter();
            Ok(vectors.map(|value| Vector3::from(*value)).collect())
        };
        let (specific_force, angular_velocity) = (vectors("acc")?, vectors("gyr")?);
        let times_ms = npz.at(&key("t_ms"))?.integers(&[None], "(N)")?.values;
        let labels = npz.at(&key("label"))?.texts()?;
        for (array, found) in [
            ("gyr", angular_velocity.len()),
            ("t_ms", times_ms.len()),
            ("label", labels.len()),
        ] {
            if found != specific_force.len() {
                let expected = specific_force.len();
                return Err(RigidError::Content {
                    name: name.to_owned(),
                    place: key(array),
                    problem: format!("{found} rows, but {prefix}acc has {expected}"),
                });
            }
        }
        Ok(Self {
            specific_force,
            angular_velocity,
            times_ms,
            labels,
        })
    }
}
