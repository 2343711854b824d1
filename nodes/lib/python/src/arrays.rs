//! Between NumPy's arrays and the libraries' types.

use cromosim_imu::{Measured, SensorFrame};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_recording::Quality;
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

/// Readings on their way to arrays.
#[derive(Default)]
pub struct Columns {
    stamps: Vec<i64>,
    forces: Vec<f64>,
    rates: Vec<f64>,
    force_covariances: Vec<f64>,
    rate_covariances: Vec<f64>,
    orientations: Vec<f64>,
    fields: Vec<f64>,
    /// Whether a device said anything of an orientation.
    oriented: bool,
}

impl Columns {
    /// With room for so many readings.
    pub fn with_capacity(count: usize) -> Self {
        Self {
            stamps: Vec::with_capacity(count),
            forces: Vec::with_capacity(3 * count),
            rates: Vec::with_capacity(3 * count),
            force_covariances: Vec::with_capacity(9 * count),
            rate_covariances: Vec::with_capacity(9 * count),
            orientations: Vec::with_capacity(4 * count),
            ..Self::default()
        }
    }

    /// Adds what a device said of a sample.
    pub fn push(&mut self, measured: &Measured) {
        let (sample, covariances) = (&measured.sample, &measured.covariances);
        self.stamps.push(sample.stamp.nanos);
        self.forces
            .extend_from_slice(sample.specific_force.as_slice());
        self.rates
            .extend_from_slice(sample.angular_velocity.as_slice());
        self.force_covariances
            .extend_from_slice(&covariances.linear_acceleration);
        self.rate_covariances
            .extend_from_slice(&covariances.angular_velocity);
        self.orientations
            .extend_from_slice(sample.world_from_sensor.coords.as_slice());
        self.oriented |= covariances.orientation[0] >= 0.0;
        if let Some(field) = &measured.magnetic_field {
            self.fields.extend_from_slice(field.as_slice());
        }
    }

    /// Of messages without orientation.
    pub fn of_messages(messages: &[Imu]) -> Self {
        let mut columns = Self::with_capacity(messages.len());
        for message in messages {
            let (f, w) = (message.linear_acceleration, message.angular_velocity);
            columns.stamps.push(message.header.stamp.nanos());
            columns.forces.extend([f.x, f.y, f.z]);
            columns.rates.extend([w.x, w.y, w.z]);
            columns
                .force_covariances
                .extend(message.linear_acceleration_covariance);
            columns
                .rate_covariances
                .extend(message.angular_velocity_covariance);
        }
        columns
    }

    /// Whether a device stated any orientation.
    pub fn are_oriented(&self) -> bool {
        self.oriented
    }

    /// The arrays by name: `stamps_ns` (N,), `specific_force`, `angular_velocity` (N, 3), the covariances
    /// of both (N, 9), `orientation` (N, 4) where it is asked for, and `magnetic_field` (N, 3), T, where a
    /// device read one.
    pub fn into_arrays(self, py: Python<'_>, oriented: bool) -> PyResult<Bound<'_, PyDict>> {
        let arrays = PyDict::new(py);
        arrays.set_item("stamps_ns", PyArray1::from_vec(py, self.stamps))?;
        arrays.set_item("specific_force", rows(py, self.forces, 3)?)?;
        arrays.set_item("angular_velocity", rows(py, self.rates, 3)?)?;
        let covariances = rows(py, self.force_covariances, 9)?;
        arrays.set_item("specific_force_covariance", covariances)?;
        let covariances = rows(py, self.rate_covariances, 9)?;
        arrays.set_item("angular_velocity_covariance", covariances)?;
        if oriented {
            arrays.set_item("orientation", rows(py, self.orientations, 4)?)?;
        }
        if !self.fields.is_empty() {
            arrays.set_item("magnetic_field", rows(py, self.fields, 3)?)?;
        }
        Ok(arrays)
    }
}

/// The arrays of a reference: `stamps_ns` (N,), `positions` (N, 3), `orientations` (N, 4).
pub fn poses<'py>(py: Python<'py>, frames: &[SensorFrame]) -> PyResult<Bound<'py, PyDict>> {
    let mut stamps = Vec::with_capacity(frames.len());
    let mut positions = Vec::with_capacity(3 * frames.len());
    let mut orientations = Vec::with_capacity(4 * frames.len());
    for frame in frames {
        let pose = &frame.world_from_sensor;
        stamps.push(frame.stamp.nanos);
        positions.extend_from_slice(pose.translation.vector.as_slice());
        orientations.extend_from_slice(pose.rotation.coords.as_slice());
    }
    let arrays = PyDict::new(py);
    arrays.set_item("stamps_ns", PyArray1::from_vec(py, stamps))?;
    arrays.set_item("positions", rows(py, positions, 3)?)?;
    arrays.set_item("orientations", rows(py, orientations, 4)?)?;
    Ok(arrays)
}

/// Beside the arrays: `bandwidth_hz` and `trimmed_s`.
pub fn set_quality(arrays: &Bound<'_, PyDict>, quality: &Quality) -> PyResult<()> {
    arrays.set_item(
        "bandwidth_hz",
        quality.bandwidth.map(|it| it.acceleration_hz),
    )?;
    arrays.set_item("trimmed_s", quality.trimmed_s)
}
