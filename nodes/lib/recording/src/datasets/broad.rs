//! BROAD (Laidig et al. 2021): the published `.mat` (`sampling_rate`, `imu_acc`, `imu_gyr`,
//! `imu_mag`, `opt_pos`, `opt_quat`, `movement`), and the same as npz (`fs`, `acc`, `gyr`, `mag`,
//! `pos`, `quat_wxyz`, `movement`); NaN where the optical system lost the body.

use std::io::{Read, Seek};
use std::path::Path;

use cromosim_arrays::{Container, Entry, Limits};
use cromosim_spatial::Stamp;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::{DatasetRecording, PlacedImu, TESLA_PER_MICROTESLA};
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
    let trial = Trial::read(&mut file, &keys, name)?;
    let movement = file
        .get("movement")?
        .map(|entry| flags(&entry))
        .transpose()?
        .filter(|flags| flags.len() == trial.acc.len());
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
    for row in 0..trial.acc.len() {
        let stamp = Stamp::from_seconds(row as f64 / rate_hz);
        match trial.reading(row) {
            Some([acc, gyr, mag]) => {
                imu.series.push(stamp, acc, gyr);
                imu.magnetic_field.push(mag * TESLA_PER_MICROTESLA);
            }
            None => imu.rows_left_out += 1,
        }
        let pose = trial.pose(row).map_err(|length| {
            let problem = format!("row {row} has length {length}, expected 1 within 0.01");
            content(name, keys.quat, problem)
        })?;
        if let Some((position, rotation)) = pose {
            optical.push(stamp, position, rotation);
        }
        if let Some(movement) = &movement {
            recording.mark(stamp, if movement[row] { "movement" } else { "rest" });
        }
    }
    (recording.imus, recording.references) = (vec![imu], vec![("body".to_owned(), optical)]);
    Ok(recording)
}

/// Where a body is, m, and how it is turned.
type BodyPose = (Vector3<f64>, UnitQuaternion<f64>);

/// The columns of a trial, one row a sample; NaN where something is missing.
struct Trial {
    acc: Vec<Vector3<f64>>,
    gyr: Vec<Vector3<f64>>,
    mag: Vec<Vector3<f64>>,
    positions: Vec<Vector3<f64>>,
    /// w first.
    quaternions: Vec<[f64; 4]>,
}

impl Trial {
    fn read<R: Read + Seek>(
        file: &mut Container<R>,
        keys: &Keys,
        name: &str,
    ) -> Result<Self, RigidError> {
        let mut vectors = |key: &str| {
            let values = rows(&file.at(key)?, 3)?;
            let vectors = values.as_chunks::<3>().0.iter();
            Ok::<_, RigidError>(
                vectors
                    .map(|value| Vector3::from(*value))
                    .collect::<Vec<_>>(),
            )
        };
        let (acc, gyr) = (vectors(keys.acc)?, vectors(keys.gyr)?);
        let (mag, positions) = (vectors(keys.mag)?, vectors(keys.pos)?);
        let quaternions = rows(&file.at(keys.quat)?, 4)?.as_chunks::<4>().0.to_vec();
        for (key, found) in [
            (keys.gyr, gyr.len()),
            (keys.mag, mag.len()),
            (keys.pos, positions.len()),
            (keys.quat, quaternions.len()),
        ] {
            if found != acc.len() {
                let problem = format!("{found} rows, but {} has {}", keys.acc, acc.len());
                return Err(content(name, key, problem));
            }
        }
        Ok(Self {
            acc,
            gyr,
            mag,
            positions,
            quaternions,
        })
    }

    /// Specific force, angular velocity and magnetic field of a row in which all are known.
    fn reading(&self, row: usize) -> Option<[Vector3<f64>; 3]> {
        let reading = [self.acc[row], self.gyr[row], self.mag[row]];
        reading.iter().all(is_finite).then_some(reading)
    }

    /// The body's pose in a row, where it was seen; the quaternion's length where it is not 1.
    fn pose(&self, row: usize) -> Result<Option<BodyPose>, f64> {
        let [w, x, y, z] = self.quaternions[row];
        // A lost body has NaN, which has no length.
        let quaternion = Quaternion::new(w, x, y, z);
        let seen = quaternion.coords.iter().all(|value| value.is_finite());
        if !(seen && is_finite(&self.positions[row])) {
            return Ok(None);
        }
        Ok(Some((self.positions[row], unit_quaternion(quaternion)?)))
    }
}

fn is_finite(vector: &Vector3<f64>) -> bool {
    vector.iter().all(|value| value.is_finite())
}

/// The numbers of an array of `columns` columns, row by row, NaN included.
fn rows(entry: &Entry, columns: usize) -> Result<Vec<f64>, RigidError> {
    Ok(entry
        .floats_with_nan(&[None, Some(columns)], &format!("(N, {columns})"))?
        .values)
}

/// Flags from a column or a list.
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
