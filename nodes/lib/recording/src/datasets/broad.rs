//! BROAD (Laidig et al. 2021): the published `.mat` (`sampling_rate`, `imu_acc`, `imu_gyr`,
//! `imu_mag`, `opt_pos`, `opt_quat`, `movement`), and the same as npz (`fs`, `acc`, `gyr`, `mag`,
//! `pos`, `quat_wxyz`, `movement`); NaN where the optical system lost the body.

use std::io::{Read, Seek};
use std::path::Path;

use cromosim_arrays::{Container, Entry, Limits};
use cromosim_spatial::Stamp;
use nalgebra::{Quaternion, Vector3};

use super::{DatasetRecording, PlacedImu};
use crate::rigid::table::unit_quaternion;
use crate::rigid::{PoseTrajectory, RigidError};

/// The longest trial is a tenth of this.
pub(super) const MAX_BYTES: u64 = 64 << 20;
const LIMITS: Limits = Limits {
    decoded_bytes: MAX_BYTES,
    opcodes: 10_000,
    depth: 10,
};

/// What the arrays are called.
struct Keys {
    rate: &'static str,
    acc: &'static str,
    gyr: &'static str,
    mag: &'static str,
    pos: &'static str,
    quat: &'static str,
}

const SHORT: Keys = Keys {
    rate: "fs",
    acc: "acc",
    gyr: "gyr",
    mag: "mag",
    pos: "pos",
    quat: "quat_wxyz",
};
const PUBLISHED: Keys = Keys {
    rate: "sampling_rate",
    acc: "imu_acc",
    gyr: "imu_gyr",
    mag: "imu_mag",
    pos: "opt_pos",
    quat: "opt_quat",
};

/// Whether these are the keys of a trial.
pub(super) fn is_broad(keys: &[String]) -> bool {
    [SHORT, PUBLISHED].iter().any(|known| {
        [known.rate, known.acc, known.gyr, known.mag, known.quat]
            .iter()
            .all(|key| has(keys, key))
    })
}

fn has(keys: &[String], key: &str) -> bool {
    keys.iter().any(|known| known == key)
}

/// Reads a trial: one IMU in a rigid body and the body's optical pose (z up) where it was seen.
/// Stamps count from 0 at the sample rate. m/s2, rad/s, microtesla, m; activities are `movement`
/// and `rest` where the file tells them apart.
///
/// # Errors
/// [`RigidError::Arrays`], [`RigidError::Content`]; both name the array.
pub fn parse_broad<R: Read + Seek>(reader: R, name: &str) -> Result<DatasetRecording, RigidError> {
    let mut file = Container::new(reader, Path::new(name), LIMITS)?;
    let keys = if has(&file.keys(), PUBLISHED.acc) {
        PUBLISHED
    } else {
        SHORT
    };
    let rate_hz = file.at(keys.rate)?.float()?;
    if !(1.0..1e5).contains(&rate_hz) {
        return Err(content(
            name,
            keys.rate,
            format!("expected a rate in Hz, found {rate_hz}"),
        ));
    }
    let mut of =
        |key: &'static str, columns| rows(&file.at(key)?, columns).map(|values| (key, values));
    let [acc, gyr, mag, pos] = [
        of(keys.acc, 3)?,
        of(keys.gyr, 3)?,
        of(keys.mag, 3)?,
        of(keys.pos, 3)?,
    ];
    let quat = of(keys.quat, 4)?;
    let count = acc.1.len() / 3;
    for (key, found) in [
        (gyr.0, gyr.1.len() / 3),
        (mag.0, mag.1.len() / 3),
        (pos.0, pos.1.len() / 3),
        (quat.0, quat.1.len() / 4),
    ] {
        if found != count {
            return Err(content(
                name,
                key,
                format!("{found} rows, but {} has {count}", keys.acc),
            ));
        }
    }
    let movement = file
        .get("movement")?
        .map(|entry| flags(&entry))
        .transpose()?
        .filter(|flags| flags.len() == count);
    let mut recording = DatasetRecording {
        name: name.to_owned(),
        rate_hz,
        ..DatasetRecording::default()
    };
    let mut imu = PlacedImu {
        placement: "body".to_owned(),
        ..PlacedImu::default()
    };
    let mut optical = PoseTrajectory {
        frame: "world".to_owned(),
        ..PoseTrajectory::default()
    };
    let vectors = |(_, values): (_, Vec<f64>)| {
        values
            .as_chunks::<3>()
            .0
            .iter()
            .map(|value| Vector3::from(*value))
            .collect::<Vec<_>>()
    };
    let (acc, gyr, mag, pos) = (vectors(acc), vectors(gyr), vectors(mag), vectors(pos));
    for (index, [w, x, y, z]) in quat.1.as_chunks::<4>().0.iter().enumerate() {
        let stamp = Stamp::from_seconds(index as f64 / rate_hz);
        let finite = |vector: &Vector3<f64>| vector.iter().all(|value| value.is_finite());
        if finite(&acc[index]) && finite(&gyr[index]) && finite(&mag[index]) {
            imu.series.push(stamp, acc[index], gyr[index]);
            imu.magnetic_field.push(mag[index]);
        } else {
            imu.rows_left_out += 1;
        }
        // A lost body has NaN, whose length is none.
        let quaternion = Quaternion::new(*w, *x, *y, *z);
        if finite(&pos[index]) && quaternion.coords.iter().all(|value| value.is_finite()) {
            let wrong = |length| {
                content(
                    name,
                    keys.quat,
                    format!("row {index} has length {length}, expected 1 within 0.01"),
                )
            };
            optical.push(
                stamp,
                pos[index],
                unit_quaternion(quaternion).map_err(wrong)?,
            );
        }
        if let Some(movement) = &movement {
            recording.mark(stamp, if movement[index] { "movement" } else { "rest" });
        }
    }
    (recording.imus, recording.references) = (vec![imu], vec![("body".to_owned(), optical)]);
    Ok(recording)
}

/// The numbers of an array of `columns` columns, row by row, NaN included.
fn rows(entry: &Entry, columns: usize) -> Result<Vec<f64>, RigidError> {
    Ok(entry
        .floats_with_nan(&[None, Some(columns)], &format!("(N, {columns})"))?
        .values)
}

/// Of a column, or of a list.
fn flags(entry: &Entry) -> Result<Vec<bool>, RigidError> {
    let any = vec![None; entry.shape()?.len()];
    Ok(entry
        .floats_with_nan(&any, "(N)")?
        .values
        .iter()
        .map(|value| *value != 0.0)
        .collect())
}

fn content(name: &str, place: &str, problem: String) -> RigidError {
    RigidError::Content {
        name: name.to_owned(),
        place: place.to_owned(),
        problem,
    }
}
