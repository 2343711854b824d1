//! BROAD (Laidig et al. 2021) as npz: `fs`, `acc`, `gyr`, `mag`, `pos`, `quat_wxyz`; NaN where the optical system lost the body.

use std::io::{Read, Seek};

use cromosim_spatial::Stamp;
use nalgebra::{Quaternion, Vector3};
use zip::ZipArchive;

use super::{DatasetRecording, PlacedImu};
use crate::camera::npy::NpyHeader;
use crate::rigid::table::unit_quaternion;
use crate::rigid::{PoseTrajectory, RigidError};

/// The longest trial is a tenth of this.
const MAX_ARRAY_BYTES: u64 = 64 << 20;

/// Reads a trial: one IMU in a rigid body and the body's optical pose (z up) where it was seen. Stamps count from 0 at the sample rate.
///
/// # Errors
/// [`RigidError::Content`] that names the array.
pub fn parse_broad<R: Read + Seek>(reader: R, name: &str) -> Result<DatasetRecording, RigidError> {
    let mut archive = ZipArchive::new(reader).map_err(|error| content(name, "npz", error.to_string()))?;
    let rate = array(&mut archive, "fs", None, name)?;
    let rate_hz =
        *rate.first().filter(|rate| (1.0..1e5).contains(*rate)).ok_or_else(|| content(name, "fs", "expected a rate in Hz".to_owned()))?;
    let acc = array(&mut archive, "acc", Some(3), name)?;
    let [gyr, mag, pos] = ["gyr", "mag", "pos"].map(|key| array(&mut archive, key, Some(3), name));
    let (gyr, mag, pos, quat) = (gyr?, mag?, pos?, array(&mut archive, "quat_wxyz", Some(4), name)?);
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

/// The numbers of an array of `columns` columns, or of a scalar.
fn array<R: Read + Seek>(archive: &mut ZipArchive<R>, key: &str, columns: Option<usize>, name: &str) -> Result<Vec<f64>, RigidError> {
    let entry = archive.by_name(&format!("{key}.npy")).map_err(|error| content(name, key, error.to_string()))?;
    let mut bytes = Vec::new();
    entry.take(MAX_ARRAY_BYTES + 1).read_to_end(&mut bytes).map_err(|error| content(name, key, error.to_string()))?;
    if bytes.len() as u64 > MAX_ARRAY_BYTES {
        return Err(content(name, key, format!("more than {MAX_ARRAY_BYTES} bytes")));
    }
    let header = NpyHeader::parse(&bytes).map_err(|problem| content(name, key, problem.to_owned()))?;
    let fits = match (columns, &header.shape[..]) {
        (None, []) => true,
        (Some(columns), [_, found]) => *found == columns,
        _ => false,
    };
    if !fits {
        let expected = columns.map_or("a scalar".to_owned(), |columns| format!("(N, {columns})"));
        return Err(content(name, key, format!("expected shape {expected}, found {:?}", header.shape)));
    }
    header.floats(&bytes).map_err(|problem| content(name, key, problem))
}

fn content(name: &str, place: &str, problem: String) -> RigidError {
    RigidError::Content { name: name.to_owned(), place: place.to_owned(), problem }
}
