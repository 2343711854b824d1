//! What the formats have in common: checked numbers, rotations, betas.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use cromosim_arrays::{Array, ArraysError, Entry, Value};
use cromosim_body::{Gender, JOINT_COUNT};
use cromosim_spatial::plausible::{JOINT_ANGLE, Oddity, PELVIS_ANGLE};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::format::MAX_POSES;
use super::track::Rotations;
use crate::MotionError;

/// Joints that SMPL shares with SMPL-H and SMPL-X; what follows are fingers, jaw and eyes.
pub(super) const SHARED_JOINTS: usize = 22;
/// No axis-angle component, position (m) or beta is larger.
const LARGEST: f64 = 1e6;
/// Frame rates of motions, Hz.
pub(super) const RATES_HZ: std::ops::RangeInclusive<f64> = 0.1..=10_000.0;
pub(super) const RATES_TEXT: &str = "0.1 to 10000 Hz";
/// More shape coefficients than any model has.
const MAX_BETAS: usize = 400;
/// How far columns of a rotation matrix may be from orthonormal: half precision stays below.
const ORTHONORMAL_WITHIN: f64 = 0.01;

/// How many frames may still be read of a file.
pub(super) struct Budget {
    path: PathBuf,
    frames: usize,
}

impl Budget {
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            frames: MAX_POSES,
        }
    }

    /// Takes `count` frames off, before memory is allocated for them. At least one is needed.
    pub fn take(&mut self, key: &str, count: usize) -> Result<(), MotionError> {
        if count == 0 {
            return Err(problem(
                &self.path,
                key,
                "it has no frames, expected one or more",
            ));
        }
        let left = self.frames.checked_sub(count);
        self.frames = left.ok_or_else(|| {
            problem(
                &self.path,
                key,
                format!("more than {MAX_POSES} frames of all people; cut the file into parts"),
            )
        })?;
        Ok(())
    }
}

/// The error for what stands under `key`.
pub(super) fn problem(path: &Path, key: &str, problem: impl Into<String>) -> MotionError {
    MotionError::Key {
        path: path.to_owned(),
        key: key.to_owned(),
        problem: problem.into(),
    }
}

/// A motion that would have more frames than are read.
pub(super) fn too_long(path: &Path) -> MotionError {
    problem(
        path,
        "frame_ids",
        format!(
            "more than {} frames with the gaps bridged; cut the file into parts",
            MAX_POSES
        ),
    )
}

/// The error for what stands in `entry`.
pub(super) fn wrong(entry: &Entry, text: impl Into<String>) -> MotionError {
    problem(entry.path(), entry.key(), text)
}

/// How many frames an array has, without decoding it; what is no array has one, and decoding it
/// says what is wrong.
pub(super) fn frame_count(entry: &Entry) -> usize {
    match entry.value() {
        Value::Array(array) => array.shape().first().copied().unwrap_or(1),
        Value::List(items) | Value::Tuple(items) => items.len(),
        _ => 1,
    }
}

/// Finite numbers of sane size.
pub(super) fn numbers(
    entry: &Entry,
    expected: &[Option<usize>],
    expectation: &str,
) -> Result<Array<f64>, MotionError> {
    let array = entry.floats(expected, expectation)?;
    let Some(element) = array.values.iter().position(|value| value.abs() > LARGEST) else {
        return Ok(array);
    };
    let value = array.values[element];
    Err(wrong(
        entry,
        format!("element {element} (C order) is {value:e}, expected at most {LARGEST:e} in size"),
    ))
}

/// (N, 3), also where it is written as (N, 1, 3).
pub(super) fn vectors(entry: &Entry, count: usize) -> Result<Vec<Vector3<f64>>, MotionError> {
    let expectation = format!("({count}, 3)");
    let expected: &[Option<usize>] = if entry.shape()?.len() == 3 {
        &[Some(count), Some(1), Some(3)]
    } else {
        &[Some(count), Some(3)]
    };
    let array = numbers(entry, expected, &expectation)?;
    Ok(array
        .values
        .chunks_exact(3)
        .map(Vector3::from_column_slice)
        .collect())
}

/// Refuses rotation vectors that no joint has: rows of `width` numbers, three for each of `joints`
/// of SMPL and then what is not looked at.
pub(super) fn check_angles(
    entry: &Entry,
    rows: &[f64],
    width: usize,
    joints: RangeInclusive<usize>,
) -> Result<(), MotionError> {
    for (frame, row) in rows.chunks_exact(width.max(1)).enumerate() {
        for (joint, vector) in joints.clone().zip(row.chunks_exact(3)) {
            let bound = if joint == 0 {
                &PELVIS_ANGLE
            } else {
                &JOINT_ANGLE
            };
            let angle = Vector3::from_column_slice(vector).norm();
            // The place is spelt out where it is odd alone.
            if let Some(odd) = bound.judge(angle, "") {
                let place = format!("frame {frame}, joint {joint}");
                return Err(wrong(entry, Oddity { place, ..odd }.to_string()));
            }
        }
    }
    Ok(())
}

/// From rows of axis times angle (rad, three numbers a joint) the rotations of the first `joints`;
/// identity for the rest of SMPL's.
pub(super) fn rotations_from_axis_angles(
    rows: &[f64],
    width: usize,
    joints: usize,
) -> Vec<Rotations> {
    let rotations = |row: &[f64]| -> Rotations {
        std::array::from_fn(|joint| match row.get(3 * joint..3 * joint + 3) {
            Some(angles) if joint < joints => {
                UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(angles))
            }
            _ => UnitQuaternion::identity(),
        })
    };
    rows.chunks_exact(width.max(1)).map(rotations).collect()
}

/// From axis times angle (rad) of the root (N, 3) and the body (N, 63) or (N, 21, 3).
pub(super) fn rotations_from_root_and_body(root: &[f64], body: &[f64]) -> Vec<Rotations> {
    let rows: Vec<f64> = root
        .chunks_exact(3)
        .zip(body.chunks_exact(63))
        .flat_map(|(root, body)| [root, body].concat())
        .collect();
    rotations_from_axis_angles(&rows, 3 * SHARED_JOINTS, SHARED_JOINTS)
}

/// The body's poses of 21 joints: (N, 63) or (N, 21, 3).
pub(super) fn body_angles(entry: &Entry, count: usize) -> Result<Array<f64>, MotionError> {
    let expected: &[Option<usize>] = if entry.shape()?.len() == 3 {
        &[Some(count), Some(21), Some(3)]
    } else {
        &[Some(count), Some(63)]
    };
    let body = numbers(entry, expected, &format!("({count}, 63)"))?;
    check_angles(entry, &body.values, 63, 1..=21)?;
    Ok(body)
}

/// From rotation matrices one after the other, each row by row.
pub(super) fn rotations_from_matrices(
    entry: &Entry,
    values: &[f64],
) -> Result<Vec<UnitQuaternion<f64>>, MotionError> {
    let one = |(index, row): (usize, &[f64])| {
        let matrix = Matrix3::from_row_slice(row);
        let deviation = (matrix.transpose() * matrix - Matrix3::identity()).amax();
        if deviation > ORTHONORMAL_WITHIN || matrix.determinant() < 0.0 {
            let text = format!(
                "matrix {index} is no rotation: columns are orthonormal within {deviation:.3} only, expected {ORTHONORMAL_WITHIN}, and no mirror"
            );
            return Err(wrong(entry, text));
        }
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
        Ok(UnitQuaternion::new_normalize(rotation.into_inner()))
    };
    values.chunks_exact(9).enumerate().map(one).collect()
}

/// 24 rotations a frame from their list.
pub(super) fn in_frames(rotations: &[UnitQuaternion<f64>]) -> Vec<Rotations> {
    rotations
        .chunks_exact(JOINT_COUNT)
        .map(|frame| std::array::from_fn(|joint| frame[joint]))
        .collect()
}

/// Shape coefficients (B), (1, B) or (N, B); (1, 0) where there are none.
pub(super) fn betas(entry: Option<&Entry>, count: usize) -> Result<Array<f64>, MotionError> {
    let Some(entry) = entry else {
        return Ok(Array {
            shape: vec![1, 0],
            values: Vec::new(),
        });
    };
    let expectation = format!("(B), (1, B) or ({count}, B) with B up to {MAX_BETAS}");
    let shape = entry.shape()?;
    let unsuitable = || ArraysError::Shape {
        path: entry.path().to_owned(),
        key: entry.key().to_owned(),
        found: shape.iter().map(|&size| size as u64).collect(),
        expected: expectation.clone(),
    };
    let (rows, columns) = match shape[..] {
        [columns] => (1, columns),
        [rows, columns] if rows == 1 || rows == count => (rows, columns),
        _ => return Err(unsuitable().into()),
    };
    if columns > MAX_BETAS {
        return Err(unsuitable().into());
    }
    let array = numbers(entry, &vec![None; shape.len()], &expectation)?;
    Ok(Array {
        shape: vec![rows, columns],
        values: array.values,
    })
}

/// `male`, `b'female'`, `neutral`; `None` for any other word.
pub(super) fn gender(entry: Option<&Entry>) -> Option<Gender> {
    let text = entry?.text().ok()?;
    Gender::from_name(text.trim_start_matches("b'").trim_end_matches('\''))
}

/// Numbers of frames: rising, one a pose.
pub(super) fn frame_ids(
    entry: Option<&Entry>,
    count: usize,
) -> Result<Option<Vec<i64>>, MotionError> {
    let Some(entry) = entry else { return Ok(None) };
    let ids = entry
        .integers(&[Some(count)], &format!("({count}), one number a frame"))?
        .values;
    if let Some(place) = ids.windows(2).position(|pair| pair[0] >= pair[1]) {
        return Err(wrong(
            entry,
            format!(
                "element {} does not exceed the one before, expected rising frame numbers",
                place + 1
            ),
        ));
    }
    Ok(Some(ids))
}
