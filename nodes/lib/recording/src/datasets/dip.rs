//! DIP-IMU (Huang et al. 2018): what a decoded pickle has to hold. The arrays come from a pickle
//! reader.

use cromosim_body::BodyPose;
use cromosim_spatial::so3;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::rigid::RigidError;

/// The sensors in the arrays' order.
pub const DIP_SENSORS: [&str; 17] = [
    "head",
    "spine2",
    "belly",
    "lchest",
    "rchest",
    "lshoulder",
    "rshoulder",
    "lelbow",
    "relbow",
    "lhip",
    "rhip",
    "lknee",
    "rknee",
    "lwrist",
    "rwrist",
    "lankle",
    "rankle",
];

/// A decoded array in C order.
#[derive(Clone, Copy, Debug)]
pub struct DipArray<'a> {
    /// Its dimensions.
    pub shape: &'a [usize],
    /// Its elements.
    pub values: &'a [f64],
}

/// A recording: 17 sensors and the reference poses. There are no gyroscopes; rates would have to be
/// derived from the orientations.
#[derive(Clone, Debug, PartialEq)]
pub struct DipRecording {
    /// `imu_ori`, (N, 17): world_from_sensor as stored; `None` where the sensor dropped out (NaN).
    pub orientations: Vec<[Option<UnitQuaternion<f64>>; 17]>,
    /// `imu_acc`, (N, 17), m/s2, as stored; `None` where the sensor dropped out (NaN).
    pub accelerations: Vec<[Option<Vector3<f64>>; 17]>,
    /// `gt`, N poses in place (the data set has no translations).
    pub poses: Vec<BodyPose>,
}

impl DipRecording {
    /// From the arrays of the pickle's dictionary: `imu_ori` (N, 17, 3, 3), `imu_acc` (N, 17, 3),
    /// `gt` (N, 72).
    ///
    /// # Errors
    /// [`RigidError::Content`] that names the array.
    pub fn from_arrays(
        imu_ori: DipArray<'_>,
        imu_acc: DipArray<'_>,
        gt: DipArray<'_>,
        name: &str,
    ) -> Result<Self, RigidError> {
        let count = gt.shape.first().copied().unwrap_or(0);
        check(&imu_ori, &[count, 17, 3, 3], "imu_ori", name)?;
        check(&imu_acc, &[count, 17, 3], "imu_acc", name)?;
        check(&gt, &[count, 72], "gt", name)?;
        let wrong = |key: &str, row: usize, problem: String| {
            content(name, key, format!("row {row}: {problem}"))
        };
        let mut orientations = Vec::with_capacity(count);
        for (row, sensors) in imu_ori.values.chunks_exact(17 * 9).enumerate() {
            let mut of_frame = [None; 17];
            for (sensor, values) in of_frame.iter_mut().zip(sensors.chunks_exact(9)) {
                if values.iter().all(|value| value.is_finite()) {
                    let matrix = Matrix3::from_row_slice(values);
                    let rotation = so3::rotation_from_matrix(&matrix, 1e-2)
                        .map_err(|error| wrong("imu_ori", row, error.to_string()))?;
                    *sensor = Some(rotation);
                }
            }
            orientations.push(of_frame);
        }
        let mut accelerations = Vec::with_capacity(count);
        for sensors in imu_acc.values.chunks_exact(17 * 3) {
            let mut of_frame = [None; 17];
            for (sensor, values) in of_frame.iter_mut().zip(sensors.as_chunks::<3>().0) {
                *sensor = Some(Vector3::from(*values))
                    .filter(|vector| vector.iter().all(|value| value.is_finite()));
            }
            accelerations.push(of_frame);
        }
        let mut poses = Vec::with_capacity(count);
        for (row, values) in gt.values.chunks_exact(72).enumerate() {
            if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                return Err(wrong("gt", row, format!("{value} is no angle")));
            }
            let joint = |joint: usize| Vector3::from_row_slice(&values[3 * joint..3 * joint + 3]);
            poses.push(BodyPose::from_axis_angles(
                Vector3::zeros(),
                &std::array::from_fn(joint),
            ));
        }
        Ok(Self {
            orientations,
            accelerations,
            poses,
        })
    }
}

fn check(array: &DipArray<'_>, shape: &[usize], key: &str, name: &str) -> Result<(), RigidError> {
    let expected = shape
        .iter()
        .try_fold(1_usize, |product, next| product.checked_mul(*next));
    if array.shape != shape || Some(array.values.len()) != expected || array.values.is_empty() {
        return Err(content(
            name,
            key,
            format!(
                "expected shape {shape:?}, found {:?} with {} values",
                array.shape,
                array.values.len()
            ),
        ));
    }
    Ok(())
}

fn content(name: &str, place: &str, problem: String) -> RigidError {
    RigidError::Content {
        name: name.to_owned(),
        place: place.to_owned(),
        problem,
    }
}
