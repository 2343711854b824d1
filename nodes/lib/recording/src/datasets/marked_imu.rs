//! An IMU on a segment that carries markers, as npz: `fs_imu`, `fs_mocap` (Hz), `acc` (N, 3) m/s2,
//! `gyr` (N, 3) rad/s, and at least three `marker_NAME` (M, 3) m, z up; NaN where a marker is
//! hidden. So the project converted gaitmap's example of a shoe.

use std::io::{Read, Seek};
use std::path::Path;

use cromosim_arrays::{Container, Limits};
use cromosim_motion::fit_rigid;
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

use super::marker_errors::{FrameResiduals, pose_stds};
use super::{DatasetRecording, PlacedImu};
use crate::rigid::{PoseTrajectory, RigidError};

/// Twenty minutes at 200 Hz take a tenth of this.
pub(super) const MAX_BYTES: u64 = 64 << 20;
const LIMITS: Limits = Limits {
    decoded_bytes: MAX_BYTES,
    opcodes: 10_000,
    depth: 10,
};
const MARKER: &str = "marker_";
/// A pose needs so many markers.
const LEAST: usize = 3;
/// More of them are no segment's.
const MOST: usize = 64;
/// Rounds in which the segment's shape is averaged.
const ROUNDS: usize = 3;

/// Whether these are such a file's keys.
pub(super) fn is_marked_imu(keys: &[String]) -> bool {
    let has = |key: &str| keys.iter().any(|known| known == key);
    ["fs_imu", "fs_mocap", "acc", "gyr"].into_iter().all(has)
        && keys.iter().filter(|key| key.starts_with(MARKER)).count() >= LEAST
}

/// Reads the IMU and the segment's pose: the rotation and position that lay the markers' mean shape
/// nearest to them (Kabsch 1976); its axes are the world's at the first frame in which every marker
/// was seen, its origin the markers' centre. What the markers leave of the rigid shape says how far
/// each pose is off. Stamps count from 0 on both clocks.
///
/// # Errors
/// [`RigidError::Arrays`], [`RigidError::Content`]; both name the array.
pub fn parse_marked_imu<R: Read + Seek>(
    reader: R,
    name: &str,
) -> Result<DatasetRecording, RigidError> {
    let content = |place: &str, problem: String| RigidError::Content {
        name: name.to_owned(),
        place: place.to_owned(),
        problem,
    };
    let mut file = Container::new(reader, Path::new(name), LIMITS)?;
    let mut rate = |key: &str| match file.at(key)?.float()? {
        rate_hz if (1.0..1e5).contains(&rate_hz) => Ok(rate_hz),
        found => Err(content(
            key,
            format!("expected a rate in Hz, found {found}"),
        )),
    };
    let [imu_hz, mocap_hz] = [rate("fs_imu")?, rate("fs_mocap")?];
    let imu = imu(&mut file, imu_hz, &content)?;
    let (keys, markers) = markers(&mut file, &content)?;
    let poses = poses(&markers, mocap_hz)
        .ok_or_else(|| content(&keys[0], "no frame shows every marker".to_owned()))?;
    let (imus, references) = (vec![imu], vec![("segment".to_owned(), poses)]);
    Ok(DatasetRecording {
        name: name.to_owned(),
        rate_hz: imu_hz,
        imus,
        references,
        ..DatasetRecording::default()
    })
}

/// The rows (N, 3) of an array, NaN included.
fn rows<R: Read + Seek>(file: &mut Container<R>, key: &str) -> Result<Vec<[f64; 3]>, RigidError> {
    let array = file.at(key)?.floats_with_nan(&[None, Some(3)], "(N, 3)")?;
    Ok(array.values.as_chunks::<3>().0.to_vec())
}

/// The readings; rows with NaN are left out and counted.
fn imu<R: Read + Seek>(
    file: &mut Container<R>,
    rate_hz: f64,
    content: &impl Fn(&str, String) -> RigidError,
) -> Result<PlacedImu, RigidError> {
    let (acc, gyr) = (rows(file, "acc")?, rows(file, "gyr")?);
    if acc.len() != gyr.len() {
        return Err(content(
            "gyr",
            format!("{} rows, but acc has {}", gyr.len(), acc.len()),
        ));
    }
    let mut imu = PlacedImu {
        placement: "segment".to_owned(),
        ..PlacedImu::default()
    };
    for (index, (acc, gyr)) in acc.iter().zip(&gyr).enumerate() {
        if acc.iter().chain(gyr).all(|value| value.is_finite()) {
            let stamp = Stamp::from_seconds(index as f64 / rate_hz);
            imu.series
                .push(stamp, Vector3::from(*acc), Vector3::from(*gyr));
        } else {
            imu.rows_left_out += 1;
        }
    }
    Ok(imu)
}

/// A marker's positions, m; `None` in frames in which it was not seen.
type Marker = Vec<Option<Vector3<f64>>>;

/// The markers by their keys, sorted; all of the same number of frames.
fn markers<R: Read + Seek>(
    file: &mut Container<R>,
    content: &impl Fn(&str, String) -> RigidError,
) -> Result<(Vec<String>, Vec<Marker>), RigidError> {
    let mut keys: Vec<String> = file
        .keys()
        .into_iter()
        .filter(|key| key.starts_with(MARKER))
        .collect();
    keys.sort();
    if !(LEAST..=MOST).contains(&keys.len()) {
        return Err(content(
            "marker_NAME",
            format!("{} markers, expected {LEAST} to {MOST}", keys.len()),
        ));
    }
    let mut markers: Vec<Marker> = Vec::with_capacity(keys.len());
    for key in &keys {
        let seen = |value: [f64; 3]| {
            let all = value.iter().all(|value| value.is_finite());
            all.then(|| Vector3::from(value))
        };
        markers.push(rows(file, key)?.into_iter().map(seen).collect());
    }
    let other = markers
        .iter()
        .position(|marker| marker.len() != markers[0].len());
    if let Some(index) = other {
        let (found, first) = (markers[index].len(), markers[0].len());
        let problem = format!("{found} frames, but {} has {first}", keys[0]);
        return Err(content(&keys[index], problem));
    }
    Ok((keys, markers))
}

/// The segment's poses in the frames that show enough of it, with how far they are off; `None` where
/// its shape is never seen whole.
fn poses(markers: &[Marker], rate_hz: f64) -> Option<PoseTrajectory> {
    let frames = markers[0].len();
    let shape = shape(markers)?;
    let mut trajectory = PoseTrajectory {
        frame: "world".to_owned(),
        ..PoseTrajectory::default()
    };
    let mut residuals = Vec::new();
    for frame in 0..frames {
        let Some((turn, shift)) = fit(markers, &shape, frame) else {
            continue;
        };
        trajectory.push(Stamp::from_seconds(frame as f64 / rate_hz), shift, turn);
        let places = markers.iter().zip(&shape).enumerate();
        let seen = places.filter_map(|(number, (marker, own))| {
            let left = turn.inverse() * (marker[frame]? - shift) - own;
            Some((number, *own, left))
        });
        let seen = seen.collect();
        residuals.push(FrameResiduals { frame, seen });
    }
    trajectory.pose_stds = pose_stds(&residuals, &shape, rate_hz);
    Some(trajectory)
}

/// The markers' mean places about their centre, m, in the world's axes at the first frame that shows all of them; `None` where
/// none does.
fn shape(markers: &[Marker]) -> Option<Vec<Vector3<f64>>> {
    let frames = markers[0].len();
    let whole = |frame: usize| {
        let seen = markers.iter().map(move |marker| marker[frame]);
        seen.collect::<Option<Vec<Vector3<f64>>>>()
    };
    let centred = |points: Vec<Vector3<f64>>| {
        let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        points
            .into_iter()
            .map(|point| point - centre)
            .collect::<Vec<_>>()
    };
    let mut shape = centred((0..frames).find_map(whole)?);
    for _ in 0..ROUNDS {
        let mut sums = vec![Vector3::zeros(); shape.len()];
        let fits =
            (0..frames).filter_map(|frame| Some((whole(frame)?, fit(markers, &shape, frame)?)));
        for (seen, (turn, shift)) in fits {
            sums.iter_mut()
                .zip(seen)
                .for_each(|(sum, point)| *sum += turn.inverse() * (point - shift));
        }
        let count = (0..frames).filter(|frame| whole(*frame).is_some()).count();
        shape = centred(sums.into_iter().map(|sum| sum / count as f64).collect());
    }
    Some(shape)
}

/// The rotation and shift that lay the shape nearest to a frame's markers; `None` where too few are seen.
fn fit(
    markers: &[Marker],
    shape: &[Vector3<f64>],
    frame: usize,
) -> Option<(UnitQuaternion<f64>, Vector3<f64>)> {
    let pairs: Vec<_> = shape
        .iter()
        .zip(markers)
        .filter_map(|(own, marker)| Some((*own, marker[frame]?)))
        .collect();
    if pairs.len() < LEAST {
        return None;
    }
    fit_rigid(&pairs)
}
