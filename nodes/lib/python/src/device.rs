//! Devices: their effects on readings that another simulator made, and a table of all effects.

use std::path::Path;

use cromosim_imu::{
    Device, EffectKind, EffectSpec, GRAVITY_IN_WORLD, ImuOptions, KinematicSample,
    OrientationSource, SampleVariance, VirtualImu,
};
use cromosim_learned::MappingFile;
use cromosim_recording::reading_mapping;
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use crate::arrays::{Columns, rotations, stamps, vectors};
use crate::error::raise;

/// A device of its name, of its file, or of a file's text.
pub fn device(name: Option<&str>, text: Option<&str>) -> PyResult<Device> {
    match text {
        Some(text) => Device::parse(text, name.unwrap_or("device")).map_err(raise),
        None => Device::resolve(name, Path::new(".")).map_err(raise),
    }
}

/// Raises what is wrong with a device.
#[pyfunction]
#[pyo3(signature = (name, text))]
pub fn check_device(name: Option<&str>, text: Option<&str>) -> PyResult<()> {
    device(name, text).map(drop)
}

/// JSON of all effects: name, summary, remedy, stage, parameters.
#[pyfunction]
pub fn effects() -> String {
    let parameter = |one: &cromosim_imu::ParameterSpec| {
        json!({
            "name": one.name,
            "unit": one.unit,
            "shape": format!("{:?}", one.shape),
            "neutral": one.neutral,
            "lower": one.lower.is_finite().then_some(one.lower),
            "upper": one.upper.is_finite().then_some(one.upper),
            "is_optional": one.is_optional,
        })
    };
    let effect = |spec: &EffectSpec| {
        json!({
            "name": spec.name,
            "summary": spec.summary,
            "remedy": spec.remedy,
            "stage": format!("{:?}", spec.stage).to_lowercase(),
            "parameters": spec.parameters.iter().map(parameter).collect::<Vec<_>>(),
        })
    };
    let all = EffectKind::ALL.into_iter();
    json!(all.map(|kind| effect(kind.spec())).collect::<Vec<_>>()).to_string()
}

/// What an error-free IMU reads, as the motion that it would read this of.
struct Ideal {
    stamps: Vec<Stamp>,
    specific_force: Vec<Vector3<f64>>,
    angular_velocity: Vec<Vector3<f64>>,
    world_from_sensor: Vec<UnitQuaternion<f64>>,
}

impl Ideal {
    /// Arrays of one length, all finite.
    fn new(
        stamps_s: &PyReadonlyArray1<'_, f64>,
        specific_force: &PyReadonlyArray2<'_, f64>,
        angular_velocity: &PyReadonlyArray2<'_, f64>,
        orientation: Option<&PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<Self> {
        let stamps = stamps(stamps_s, "stamps_s")?;
        let specific_force = vectors(specific_force, "specific_force")?;
        let angular_velocity = vectors(angular_velocity, "angular_velocity")?;
        let world_from_sensor = match orientation {
            Some(array) => rotations(array, "orientation")?,
            None => vec![UnitQuaternion::identity(); stamps.len()],
        };
        for (name, count) in [
            ("specific_force", specific_force.len()),
            ("angular_velocity", angular_velocity.len()),
            ("orientation", world_from_sensor.len()),
        ] {
            if count != stamps.len() {
                return Err(raise(format!(
                    "{name}: {count} rows, but stamps_s has {}",
                    stamps.len()
                )));
            }
        }
        for (name, values) in [
            ("specific_force", &specific_force),
            ("angular_velocity", &angular_velocity),
        ] {
            let bad = |v: &Vector3<f64>| !v.iter().all(|x| x.is_finite());
            if let Some(row) = values.iter().position(bad) {
                return Err(raise(format!("{name}, row {row}: not finite")));
            }
        }
        Ok(Self {
            stamps,
            specific_force,
            angular_velocity,
            world_from_sensor,
        })
    }

    fn sample(&self, k: usize) -> KinematicSample {
        let turn = self.world_from_sensor[k];
        KinematicSample {
            stamp: self.stamps[k],
            world_from_sensor: Isometry3::from_parts(Vector3::zeros().into(), turn),
            acceleration_in_world: turn * self.specific_force[k] + GRAVITY_IN_WORLD,
            angular_velocity_in_world: turn * self.angular_velocity[k],
            angular_acceleration_in_world: None,
            variance: SampleVariance::default(),
            bandwidth: None,
        }
    }

    /// The mean number of samples per second.
    fn rate_hz(&self) -> PyResult<f64> {
        match self.stamps.as_slice() {
            [first, .., last] => Ok((self.stamps.len() - 1) as f64 / (*last - *first)),
            _ => Err(raise("stamps_s: at least 2 readings are needed")),
        }
    }
}

/// A device's readings where an error-free one reads these.
#[pyfunction]
#[pyo3(signature = (device_name, device_text, stamps_s, specific_force, angular_velocity, orientation, *, rate_hz, seed, noise, name, mapping))]
#[allow(clippy::too_many_arguments)]
pub fn apply_device<'py>(
    py: Python<'py>,
    device_name: Option<&str>,
    device_text: Option<&str>,
    stamps_s: PyReadonlyArray1<'py, f64>,
    specific_force: PyReadonlyArray2<'py, f64>,
    angular_velocity: PyReadonlyArray2<'py, f64>,
    orientation: Option<PyReadonlyArray2<'py, f64>>,
    rate_hz: Option<f64>,
    seed: u64,
    noise: bool,
    name: String,
    mapping: Option<&str>,
) -> PyResult<Bound<'py, PyDict>> {
    let device = device(device_name, device_text)?;
    let gravity = device.effects().get(EffectKind::GravityConvention);
    if gravity.is_some() && orientation.is_none() {
        return Err(raise(
            "orientation: the device's effect gravity_convention depends on it; give world_from_sensor of each reading",
        ));
    }
    let oriented = orientation.is_some();
    let ideal = Ideal::new(
        &stamps_s,
        &specific_force,
        &angular_velocity,
        orientation.as_ref(),
    )?;
    let mapping = mapping.map(|path| MappingFile::read(Path::new(path)));
    let mapping = mapping.transpose().map_err(raise)?.unwrap_or_default();
    let columns = py.detach(|| {
        let options = ImuOptions {
            rate_hz: rate_hz.map_or_else(|| ideal.rate_hz(), Ok)?,
            seed,
            mapping: reading_mapping(&mapping, &name),
            frame_id: format!("{name}_imu"),
            name,
            noise,
            field: None,
            orientation: OrientationSource::Truth,
        };
        let mut imu = VirtualImu::new(&device, options).map_err(raise)?;
        let samples = (0..ideal.stamps.len()).map(|k| ideal.sample(k));
        let mut columns = Columns::with_capacity(ideal.stamps.len());
        let measured = samples.filter_map(|sample| imu.read(&sample));
        measured.for_each(|it| columns.push(&it));
        Ok::<_, PyErr>(columns)
    })?;
    columns.into_arrays(py, oriented)
}
