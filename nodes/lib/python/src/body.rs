//! Bodies as arrays.

use std::path::PathBuf;

use cromosim_body::{BodyPose, JOINT_COUNT, ShapedBody};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::arrays::rows;
use crate::error::raise;
use crate::motion::{Motion, body_poses, model};

/// A body of one shape.
#[pyclass(frozen, module = "cromosim._native")]
pub struct Body {
    shaped: ShapedBody,
}

/// Poses of a motion, or of arrays.
#[derive(FromPyObject)]
pub enum Poses<'py> {
    Motion(PyRef<'py, Motion>),
    Arrays(PyReadonlyArray3<'py, f64>, PyReadonlyArray2<'py, f64>),
}

impl Poses<'_> {
    fn frames(&self) -> PyResult<Vec<BodyPose>> {
        match self {
            Self::Motion(motion) => Ok(motion.motion.frames.clone()),
            Self::Arrays(rotations, positions) => body_poses(rotations, positions),
        }
    }
}

#[pymethods]
impl Body {
    #[new]
    #[pyo3(signature = (betas, path))]
    fn new(py: Python<'_>, betas: Vec<f64>, path: Option<PathBuf>) -> PyResult<Self> {
        py.detach(|| {
            let shaped = ShapedBody::new(model(path.as_deref())?, &betas).map_err(raise)?;
            Ok(Self { shaped })
        })
    }

    #[getter]
    fn id(&self) -> &str {
        self.shaped.model().id()
    }

    #[getter]
    fn betas<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.shaped.betas())
    }

    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let corners = self.shaped.model().faces().iter().flatten().copied();
        rows(py, corners.collect(), 3)
    }

    #[getter]
    fn site_names(&self) -> Vec<String> {
        let names = self.shaped.model().site_names();
        names.map(str::to_owned).collect()
    }

    #[getter]
    fn rest_vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let vertices = self.shaped.rest_vertices().iter();
        rows(py, vertices.flat_map(|&v| <[f64; 3]>::from(v)).collect(), 3)
    }

    /// (N, V, 3), m.
    fn vertices<'py>(
        &self,
        py: Python<'py>,
        poses: Poses<'py>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let frames = poses.frames()?;
        let vertices = py.detach(|| {
            let mut vertices = Vec::new();
            self.shaped.skin_batch(&frames, &mut vertices);
            // A list of triples is one of numbers: no value moves.
            vertices.into_flattened()
        });
        let count = self.shaped.model().vertex_count();
        PyArray1::from_vec(py, vertices).reshape([frames.len(), count, 3])
    }

    /// (N, 24, 3), m.
    fn joints<'py>(
        &self,
        py: Python<'py>,
        poses: Poses<'py>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let frames = poses.frames()?;
        let joints = py.detach(|| {
            let segments = frames
                .iter()
                .flat_map(|pose| self.shaped.world_from_segments(pose));
            let positions = segments.flat_map(|it| <[f64; 3]>::from(it.translation.vector));
            positions.collect::<Vec<f64>>()
        });
        PyArray1::from_vec(py, joints).reshape([frames.len(), JOINT_COUNT, 3])
    }
}
