//! Motions, on the body that they were read for.

use cromosim_spatial::in_plain_words;
use std::path::{self, Path, PathBuf};
use std::sync::Arc;

use cromosim_body::{BodyModel, BodyPose, Gender, JOINT_COUNT, ShapeSpace};
use cromosim_motion::{
    MarkerReport, MotionOptions, PoseReport, RetargetReport, SmplMotion, embedded_walk,
    read_motion_for,
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::arrays::{rows, vectors};
use crate::error::raise;
use crate::workers::on_all_cores;

/// A person's motion.
#[pyclass(frozen, module = "cromosim._native")]
pub struct Motion {
    pub motion: Arc<SmplMotion>,
    pub model: Arc<BodyModel>,
    /// The file of `model`; none: it is the embedded one.
    body: Option<PathBuf>,
    /// The part that is simulated, s; the rest is there for its derivatives.
    pub start_s: f64,
    pub duration_s: Option<f64>,
}

/// The model of a file, or the embedded one.
pub fn model(path: Option<&Path>) -> PyResult<Arc<BodyModel>> {
    match path {
        Some(path) => BodyModel::read(path).map_err(raise),
        None => Ok(BodyModel::embedded()),
    }
}

/// Reads a motion file; `options` is JSON with the fields of `MotionOptions`.
#[pyfunction]
#[pyo3(signature = (path, body, options))]
pub fn read_motion(
    py: Python<'_>,
    path: PathBuf,
    body: Option<PathBuf>,
    options: &str,
) -> PyResult<Motion> {
    let options: MotionOptions = serde_json::from_str(options)
        .map_err(|error| raise(format!("read_motion: {}", in_plain_words(error))))?;
    on_all_cores(py, || {
        let model = model(body.as_deref())?;
        let whole = MotionOptions {
            start_s: 0.0,
            duration_s: None,
            ..options.clone()
        };
        let motion = read_motion_for(&path, &model, &whole).map_err(raise)?;
        motion
            .part(options.start_s, options.duration_s)
            .map_err(raise)?;
        Ok(Motion {
            motion: Arc::new(motion),
            model,
            body,
            start_s: options.start_s,
            duration_s: options.duration_s,
        })
    })
}

/// The embedded ten-second walk.
#[pyfunction]
pub fn walk(py: Python<'_>) -> Motion {
    py.detach(|| Motion {
        motion: Arc::new(embedded_walk()),
        model: BodyModel::embedded(),
        body: None,
        start_s: 0.0,
        duration_s: None,
    })
}

/// What a motion is beside its arrays, for the processes that it is sent to.
#[derive(Serialize, Deserialize)]
struct Description {
    name: String,
    rate_hz: f64,
    gender: Gender,
    shape_space: ShapeSpace,
    report: Option<RetargetReport>,
    markers: Option<MarkerReport>,
    poses: Option<PoseReport>,
    body: Option<PathBuf>,
    start_s: f64,
    duration_s: Option<f64>,
}

/// A [`Description`] as YAML, which holds numbers to the last bit; betas (B,), root positions (N, 3), quaternions
/// x, y, z, w of the joints (N, 24, 4) and confidence (N,).
type State<'py> = (
    String,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray3<f64>>,
    Option<Bound<'py, PyArray1<f64>>>,
);

/// (N, 24, 3) of rotation vectors and (N, 3) of positions as poses.
pub fn body_poses(
    rotations: &PyReadonlyArray3<'_, f64>,
    positions: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<BodyPose>> {
    let positions = vectors(positions, "root_positions")?;
    let rotations = rotations.as_array();
    let shape = rotations.shape();
    if shape != [positions.len(), JOINT_COUNT, 3] {
        return Err(raise(format!(
            "rotations: expected shape ({}, {JOINT_COUNT}, 3), as root_positions has rows; found {shape:?}",
            positions.len()
        )));
    }
    let finite = |number: usize| {
        let turned = rotations.index_axis(numpy::ndarray::Axis(0), number);
        turned
            .iter()
            .chain(positions[number].iter())
            .all(|x| x.is_finite())
    };
    if let Some(number) = (0..positions.len()).find(|&number| !finite(number)) {
        return Err(raise(format!(
            "rotations, root_positions: frame {number} is not finite"
        )));
    }
    let pose = |(number, position): (usize, &Vector3<f64>)| {
        let axis_angle =
            |joint: usize| Vector3::from_fn(|axis, _| rotations[[number, joint, axis]]);
        BodyPose::from_axis_angles(*position, &std::array::from_fn(axis_angle))
    };
    Ok(positions.iter().enumerate().map(pose).collect())
}

#[pymethods]
impl Motion {
    /// A motion of arrays.
    #[new]
    #[pyo3(signature = (rotations, root_positions, rate_hz, betas, body, name))]
    fn new(
        rotations: PyReadonlyArray3<'_, f64>,
        root_positions: PyReadonlyArray2<'_, f64>,
        rate_hz: f64,
        betas: Vec<f64>,
        body: Option<PathBuf>,
        name: String,
    ) -> PyResult<Self> {
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return Err(raise(format!("rate_hz {rate_hz}: expected more than 0 Hz")));
        }
        let model = model(body.as_deref())?;
        let frames = body_poses(&rotations, &root_positions)?;
        if frames.is_empty() {
            return Err(raise("rotations: no frame; a motion has at least one"));
        }
        let motion = SmplMotion {
            name,
            rate_hz,
            gender: model.gender().unwrap_or(Gender::Neutral),
            betas,
            shape_space: model.shape_space(),
            frames: cromosim_motion::continuous(frames),
            confidence: None,
            report: None,
            markers: None,
            poses: None,
        };
        Ok(Self {
            motion: Arc::new(motion),
            model,
            body,
            start_s: 0.0,
            duration_s: None,
        })
    }

    /// All that [`Motion::of_state`] makes the same motion of.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<State<'py>> {
        let motion = &*self.motion;
        let body = self.body.as_ref().map(path::absolute).transpose();
        let description = Description {
            name: motion.name.clone(),
            rate_hz: motion.rate_hz,
            gender: motion.gender,
            shape_space: motion.shape_space,
            report: motion.report.clone(),
            markers: motion.markers.clone(),
            poses: motion.poses.clone(),
            body: body.map_err(raise)?,
            start_s: self.start_s,
            duration_s: self.duration_s,
        };
        let text = serde_norway::to_string(&description).map_err(raise)?;
        let joints = motion.frames.iter().flat_map(|pose| &pose.local_rotations);
        let quaternions = joints.flat_map(|joint| <[f64; 4]>::from(joint.coords));
        let quaternions = PyArray1::from_vec(py, quaternions.collect());
        let quaternions = quaternions.reshape([motion.frames.len(), JOINT_COUNT, 4])?;
        let (betas, positions) = (self.betas(py), self.root_positions(py)?);
        Ok((text, betas, positions, quaternions, self.confidence(py)))
    }

    /// The motion that had this [`Motion::state`].
    #[staticmethod]
    fn of_state(
        description: &str,
        betas: Vec<f64>,
        root_positions: PyReadonlyArray2<'_, f64>,
        quaternions: PyReadonlyArray3<'_, f64>,
        confidence: Option<Vec<f64>>,
    ) -> PyResult<Self> {
        let told: Description = serde_norway::from_str(description)
            .map_err(|error| raise(format!("motion: {}", in_plain_words(error))))?;
        let positions = vectors(&root_positions, "root_positions")?;
        let quaternions = quaternions.as_array();
        if quaternions.shape() != [positions.len(), JOINT_COUNT, 4] {
            return Err(raise("motion: not as many rotations as positions"));
        }
        let pose = |(number, root_position): (usize, Vector3<f64>)| BodyPose {
            root_position,
            local_rotations: std::array::from_fn(|joint| {
                let [x, y, z, w] = std::array::from_fn(|part| quaternions[[number, joint, part]]);
                UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
            }),
        };
        let motion = SmplMotion {
            name: told.name,
            rate_hz: told.rate_hz,
            gender: told.gender,
            betas,
            shape_space: told.shape_space,
            frames: positions.into_iter().enumerate().map(pose).collect(),
            confidence,
            report: told.report,
            markers: told.markers,
            poses: told.poses,
        };
        Ok(Self {
            motion: Arc::new(motion),
            model: model(told.body.as_deref())?,
            body: told.body,
            start_s: told.start_s,
            duration_s: told.duration_s,
        })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.motion.name
    }

    #[getter]
    fn rate_hz(&self) -> f64 {
        self.motion.rate_hz
    }

    #[getter]
    fn duration_s(&self) -> f64 {
        self.motion.duration_s()
    }

    #[getter]
    fn betas<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.motion.betas)
    }

    #[getter]
    fn root_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let frames = self.motion.frames.iter();
        let positions = frames.flat_map(|pose| <[f64; 3]>::from(pose.root_position));
        rows(py, positions.collect(), 3)
    }

    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let frames = self.motion.frames.iter();
        let joints = frames.flat_map(BodyPose::axis_angles);
        let values: Vec<f64> = joints.flat_map(<[f64; 3]>::from).collect();
        PyArray1::from_vec(py, values).reshape([self.motion.frames.len(), JOINT_COUNT, 3])
    }

    #[getter]
    fn confidence<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let values = self.motion.confidence.as_ref()?;
        Some(PyArray1::from_slice(py, values))
    }

    #[getter]
    fn how_read(&self) -> Option<String> {
        self.motion.how_read()
    }

    #[getter]
    fn oddities(&self) -> Vec<String> {
        self.motion
            .oddities()
            .iter()
            .map(ToString::to_string)
            .collect()
    }

    fn __len__(&self) -> usize {
        self.motion.frames.len()
    }
}
