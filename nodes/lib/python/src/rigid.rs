//! IMUs on rigid bodies, whole or live.

use cromosim_imu::{
    Device, EffectsFile, ImuOptions, OrientationSource, PlacementEffects, Scheme, SensorFrame,
    StreamOptions, StreamingImu, TextureSegment, VirtualImu,
};
use cromosim_learned::scheme_for_networks;
use cromosim_recording::{RecordedPlacement, Resimulation};
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Columns, rotations, set_quality, stamps, vectors};
use crate::device::device;
use crate::error::raise;
use crate::simulate::Options;
use crate::workers::on_all_cores;

/// The IMU of a rigid body that moves along these poses.
#[pyfunction]
#[pyo3(signature = (name, stamps_s, positions, orientations, rate_hz, device_name, device_text, options))]
#[allow(clippy::too_many_arguments)]
pub fn simulate_rigid<'py>(
    py: Python<'py>,
    name: String,
    stamps_s: PyReadonlyArray1<'py, f64>,
    positions: PyReadonlyArray2<'py, f64>,
    orientations: PyReadonlyArray2<'py, f64>,
    rate_hz: f64,
    device_name: Option<&str>,
    device_text: Option<&str>,
    options: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let device = device(device_name, device_text)?;
    let frames = frames(&stamps_s, &positions, &orientations)?;
    let options = Options::parse(options)?;
    let resimulated = on_all_cores(py, || {
        let recorded = RecordedPlacement {
            name: name.clone(),
            frames,
            measured: Vec::new(),
            notes: Vec::new(),
            set_back: Vec::new(),
            magnetic: Vec::new(),
        };
        let scheme = options
            .differentiation
            .unwrap_or_else(|| match &options.learned {
                Some(_) => scheme_for_networks(Scheme::default()).into(),
                None => Scheme::default().into(),
            });
        let how = Resimulation {
            scheme: Some(scheme),
            trim: options.trim,
            effects: of_device(&name, &device, recorded.span().0),
            texture: options
                .texture
                .map(|texture| texture.or(TextureSegment::Held)),
            learned: options.learned,
            mapping: options.mapping,
            rate_hz: Some(rate_hz),
            seed: options.seed,
            noise: options.noise,
            field: None,
        };
        how.simulate(&recorded).map_err(raise)
    })?;
    let arrays = Columns::of_messages(&resimulated.messages).into_arrays(py, false)?;
    set_quality(&arrays, &resimulated.quality)?;
    Ok(arrays)
}

/// The effects of one placement, which are its device's.
fn of_device(name: &str, device: &Device, epoch: Stamp) -> EffectsFile {
    let effects = PlacementEffects {
        epoch,
        declared_noise: device.declared_noise(),
        effects: device.effects().clone(),
        unexplained: device.unexplained(),
        reference_response: None,
        other_sessions: Vec::new(),
        magnetometer: device.magnetometer().cloned(),
        field_in_world: None,
    };
    let mut file = EffectsFile::default();
    file.placements.insert(name.to_owned(), effects);
    file
}

/// At least one finite pose, stamps increasing.
pub fn frames(
    stamps_s: &PyReadonlyArray1<'_, f64>,
    positions: &PyReadonlyArray2<'_, f64>,
    orientations: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<SensorFrame>> {
    let stamps = stamps(stamps_s, "stamps_s")?;
    let positions = vectors(positions, "positions")?;
    let orientations = rotations(orientations, "orientations")?;
    if positions.len() != stamps.len() || orientations.len() != stamps.len() || stamps.len() < 2 {
        return Err(raise(format!(
            "stamps_s, positions, orientations: {}, {} and {} rows; expected equally many, at least 2",
            stamps.len(),
            positions.len(),
            orientations.len()
        )));
    }
    if let Some(row) = positions
        .iter()
        .position(|p| !p.iter().all(|x| x.is_finite()))
    {
        return Err(raise(format!("positions, row {row}: not finite")));
    }
    let poses = positions.into_iter().zip(orientations).zip(stamps);
    let frame = |((at, turn), stamp): ((Vector3<f64>, UnitQuaternion<f64>), Stamp)| {
        SensorFrame::new(stamp, Isometry3::from_parts(at.into(), turn))
    };
    Ok(poses.map(frame).collect())
}

/// An IMU that takes one pose a call.
#[pyclass(module = "cromosim._native")]
pub struct Stream {
    scheme: StreamingImu,
    imu: VirtualImu,
}

#[pymethods]
impl Stream {
    #[new]
    #[pyo3(signature = (name, input_rate_hz, rate_hz, scheme, device_name, device_text, seed, noise))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        name: String,
        input_rate_hz: f64,
        rate_hz: f64,
        scheme: Option<&str>,
        device_name: Option<&str>,
        device_text: Option<&str>,
        seed: u64,
        noise: bool,
    ) -> PyResult<Self> {
        let device = device(device_name, device_text)?;
        let scheme = scheme.map(str::parse::<Scheme>).transpose();
        let scheme = scheme.map_err(|error| raise(format!("scheme: {error}")))?;
        let options = StreamOptions::resampled(input_rate_hz, rate_hz);
        let imu = ImuOptions {
            rate_hz,
            seed,
            frame_id: format!("{name}_imu"),
            name,
            noise,
            mapping: None,
            field: None,
            orientation: OrientationSource::Truth,
        };
        Ok(Self {
            scheme: StreamingImu::new(scheme.unwrap_or_default(), options).map_err(raise)?,
            imu: VirtualImu::new(&device, imu).map_err(raise)?,
        })
    }

    #[getter]
    fn delay_s(&self) -> f64 {
        self.scheme.delay_seconds()
    }

    fn push<'py>(
        &mut self,
        py: Python<'py>,
        stamp_s: f64,
        position: [f64; 3],
        orientation: [f64; 4],
    ) -> PyResult<Bound<'py, PyDict>> {
        let [x, y, z, w] = orientation;
        let turn = Quaternion::new(w, x, y, z);
        let norm = turn.norm();
        // As of arrays: what single precision leaves.
        if norm.is_nan() || (norm - 1.0).abs() > 1e-3 {
            return Err(raise(format!(
                "orientation: a quaternion x, y, z, w of norm {norm}; it must be 1"
            )));
        }
        if stamp_s.is_nan() || stamp_s.abs() >= 9e9 {
            return Err(raise(format!("stamp_s: {stamp_s} is no stamp in seconds")));
        }
        let pose = Isometry3::from_parts(position.into(), UnitQuaternion::new_normalize(turn));
        let frame = SensorFrame::new(Stamp::from_seconds(stamp_s), pose);
        let samples = self.scheme.push_kinematics(frame).map_err(raise)?;
        self.arrays(py, &samples)
    }

    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let samples = self.scheme.finish_kinematics().map_err(raise)?;
        self.arrays(py, &samples)
    }
}

impl Stream {
    fn arrays<'py>(
        &mut self,
        py: Python<'py>,
        samples: &[cromosim_imu::KinematicSample],
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut columns = Columns::with_capacity(samples.len());
        let measured = samples.iter().filter_map(|sample| self.imu.read(sample));
        measured.for_each(|it| columns.push(&it));
        columns.into_arrays(py, true)
    }
}
