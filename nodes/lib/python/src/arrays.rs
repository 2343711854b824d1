//! Between NumPy's arrays and the libraries' types.

use cromosim_msgs::geometry_msgs::{PoseStamped, Quaternion};
use cromosim_msgs::sensor_msgs::{Imu, MagneticField};
use cromosim_recording::rigid::unit_quaternion;
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::raise;

/// (N, `width`) of N rows; the values are moved, not copied.
pub fn rows<'py, T: numpy::Element>(
    py: Python<'py>,
    values: Vec<T>,
    width: usize,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let count = values.len() / width;
    PyArray1::from_vec(py, values).reshape([count, width])
}

/// (N, 3) of vectors.
pub fn vectors(array: &PyReadonlyArray2<'_, f64>, name: &str) -> PyResult<Vec<Vector3<f64>>> {
    let view = array.as_array();
    if view.ncols() != 3 {
        return Err(raise(format!(
            "{name}: expected shape (N, 3), found ({}, {})",
            view.nrows(),
            view.ncols()
        )));
    }
    let vector = |row: numpy::ndarray::ArrayView1<'_, f64>| Vector3::new(row[0], row[1], row[2]);
    Ok(view.rows().into_iter().map(vector).collect())
}

/// (N, 4) of quaternions x, y, z, w, as files of trajectories are read: the same bits then give the
/// same readings.
pub fn rotations(
    array: &PyReadonlyArray2<'_, f64>,
    name: &str,
) -> PyResult<Vec<UnitQuaternion<f64>>> {
    let view = array.as_array();
    if view.ncols() != 4 {
        return Err(raise(format!(
            "{name}: expected shape (N, 4), x, y, z, w; found ({}, {})",
            view.nrows(),
            view.ncols()
        )));
    }
    let rotation = |(number, row): (usize, numpy::ndarray::ArrayView1<'_, f64>)| {
        let quaternion = nalgebra::Quaternion::new(row[3], row[0], row[1], row[2]);
        unit_quaternion(quaternion).map_err(|norm| {
            raise(format!(
                "{name}, row {number}: a quaternion x, y, z, w of norm {norm}; it must be 1"
            ))
        })
    };
    view.rows().into_iter().enumerate().map(rotation).collect()
}

/// Stamps that increase, of seconds.
pub fn stamps(array: &PyReadonlyArray1<'_, f64>, name: &str) -> PyResult<Vec<Stamp>> {
    let view = array.as_array();
    // Stamps count nanoseconds in 64 bits.
    let representable = |seconds: f64| seconds.abs() < 9e9;
    for (number, &seconds) in view.iter().enumerate() {
        if !representable(seconds) {
            return Err(raise(format!(
                "{name}, row {number}: {seconds} is no stamp in seconds"
            )));
        }
        if number > 0 && seconds <= view[number - 1] {
            return Err(raise(format!(
                "{name}, row {number}: {seconds} s is not after {} s, the one before",
                view[number - 1]
            )));
        }
    }
    Ok(view.iter().map(|&s| Stamp::from_seconds(s)).collect())
}

/// The arrays of messages by name: `stamps_ns` (N,), `specific_force`, `angular_velocity` (N, 3),
/// `orientation` (N, 4) where `oriented`, and the three covariances (N, 9).
pub fn readings<'py>(
    py: Python<'py>,
    messages: &[Imu],
    orientations: Option<&[Imu]>,
) -> PyResult<Bound<'py, PyDict>> {
    let vector = |of: fn(&Imu) -> [f64; 3]| messages.iter().flat_map(of).collect::<Vec<f64>>();
    let matrix = |of: fn(&Imu) -> [f64; 9]| messages.iter().flat_map(of).collect::<Vec<f64>>();
    let stamps: Vec<i64> = messages.iter().map(|m| m.header.stamp.nanos()).collect();
    let arrays = PyDict::new(py);
    arrays.set_item("stamps_ns", PyArray1::from_vec(py, stamps))?;
    let forces = vector(|m| {
        let v = &m.linear_acceleration;
        [v.x, v.y, v.z]
    });
    arrays.set_item("specific_force", rows(py, forces, 3)?)?;
    let rates = vector(|m| {
        let v = &m.angular_velocity;
        [v.x, v.y, v.z]
    });
    arrays.set_item("angular_velocity", rows(py, rates, 3)?)?;
    let covariance = matrix(|m| m.linear_acceleration_covariance);
    arrays.set_item("specific_force_covariance", rows(py, covariance, 9)?)?;
    let covariance = matrix(|m| m.angular_velocity_covariance);
    arrays.set_item("angular_velocity_covariance", rows(py, covariance, 9)?)?;
    if let Some(oriented) = orientations {
        let values = oriented.iter().flat_map(|m| xyzw(&m.orientation)).collect();
        arrays.set_item("orientation", rows(py, values, 4)?)?;
    }
    Ok(arrays)
}

/// Magnetometer readings, (N, 3), T.
pub fn magnetic_fields<'py>(
    py: Python<'py>,
    messages: &[MagneticField],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let values = messages.iter().flat_map(|message| {
        let v = &message.magnetic_field;
        [v.x, v.y, v.z]
    });
    rows(py, values.collect(), 3)
}

/// The arrays of a reference: `stamps_ns` (N,), `positions` (N, 3), `orientations` (N, 4).
pub fn poses<'py>(py: Python<'py>, poses: &[PoseStamped]) -> PyResult<Bound<'py, PyDict>> {
    let stamps: Vec<i64> = poses.iter().map(|p| p.header.stamp.nanos()).collect();
    let positions = poses.iter().flat_map(|p| {
        let at = &p.pose.position;
        [at.x, at.y, at.z]
    });
    let orientations = poses.iter().flat_map(|p| xyzw(&p.pose.orientation));
    let arrays = PyDict::new(py);
    arrays.set_item("stamps_ns", PyArray1::from_vec(py, stamps))?;
    arrays.set_item("positions", rows(py, positions.collect(), 3)?)?;
    arrays.set_item("orientations", rows(py, orientations.collect(), 4)?)?;
    Ok(arrays)
}

fn xyzw(q: &Quaternion) -> [f64; 4] {
    [q.x, q.y, q.z, q.w]
}
