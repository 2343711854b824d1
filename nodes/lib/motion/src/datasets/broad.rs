//! BROAD (Laidig et al. 2021) as npz: `fs`, `acc`, `gyr`, `mag`, `pos`, `quat_wxyz`; NaN where the optical system lost the body.

use std::io::{Read, Seek};
use std::path::Path;

use cromosim_arrays::{Limits, NpzReader};
use cromosim_spatial::Stamp;
use nalgebra::{Quaternion, Vector3};

use super::{DatasetRecording, PlacedImu};
use crate::rigid::table::unit_quaternion;
use crate::rigid::{PoseTrajectory, RigidError};

/// The longest trial is a tenth of this.
const LIMITS: Limits = Limits { decoded_bytes: 64 << 20, opcodes: 10_000, depth: 10 };

/// Reads a trial: one IMU in a rigid body and the body's optical pose (z up) where it was seen. Stamps count from 0 at the sample rate.
///
/// # Errors
/// [`RigidError::Arrays`], [`RigidError::Content`]; both name the array.
pub fn parse_broad<R: Read + Seek>(reader: R, name: &str) -> Result<DatasetRecording, RigidError> {
    let mut npz = NpzReader::with_limits(reader, Path::new(name), LIMITS)?;
    let rate_hz = npz.at("fs")?.float()?;
    if !(1.0..1e5).contains(&rate_hz) {
        return Err(content(name, "fs", format!("expected a rate in Hz, found {rate_hz}")));
    }
    let acc = rows(&mut npz, "acc", 3)?;
    let [gyr, mag, pos] = ["gyr", "mag", "pos"].map(|key| rows(&mut npz, key, 3));
    let (gyr, mag, pos, quat) = (gyr?, mag?, pos?, rows(&mut npz, "quat_wxyz", 4)?);
    let count = acc.len() / 3;
    for (key, found) in [("gyr", gyr.len() / 3), ("mag", mag.len() / 3), ("pos", pos.len() / 3), ("quat_wxyz", quat.len() / 4)] {
        if found != count {
            return Err(content(name, key, format!("{found} rows, but acc has {count}")));
        }
    }
    let mut imu = PlacedImu { placement: "body".to_owned(), ..PlacedImu::default() };
    let mut optical = PoseTrajectory { frame: "world".to_owned(), ..PoseTrajectory::default() };
    let vectors = |values: &[f64]| values.as_chunks::<3>().0.iter().map(|value| Vector3::from(*value)).collect::<Vec<_>>();
    let (acc, gyr, mag, pos) = (vectors(&acc), vectors(&gyr), vectors(&mag), vectors(&pos));
    for (index, [w, x, y, z]) in quat.as_chunks::<4>().0.iter().enumerate() {
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
            let wrong = |length| content(name, "quat_wxyz", format!("row {index} has length {length}, expected 1 within 0.01"));
            optical.push(stamp, pos[index], unit_quaternion(quaternion).map_err(wrong)?);
        }
    }
    let references = vec![("body".to_owned(), optical)];
    Ok(DatasetRecording { name: name.to_owned(), rate_hz, imus: vec![imu], references, activities: Vec::new() })
}

/// The numbers of an array of `columns` columns, row by row, NaN included.
fn rows<R: Read + Seek>(npz: &mut NpzReader<R>, key: &str, columns: usize) -> Result<Vec<f64>, RigidError> {
    let expectation = format!("(N, {columns})");
    Ok(npz.at(key)?.floats_with_nan(&[None, Some(columns)], &expectation)?.values)
}

fn content(name: &str, place: &str, problem: String) -> RigidError {
    RigidError::Content { name: name.to_owned(), place: place.to_owned(), problem }
}
