//! Which shape a motion's body has.

use std::path::Path;
use std::sync::Arc;

use cromosim_body::{BodyError, BodyModel, JOINT_COUNT, Joint, ShapeFit, ShapedBody};
use nalgebra::Vector3;
use serde::Deserialize;

use super::report::ShapeOrigin;
use super::track::PoseTrack;
use crate::MotionError;

/// Where the body's shape comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeChoice {
    /// For skeletons, the fit. For SMPL parameters the file's betas where they are those of the
    /// body; else a fit where `source_body` is given; else the mean body, and the report says so.
    #[default]
    Detect,
    /// The file's betas; an error where they are those of another kind of body, or where there are
    /// none.
    File,
    /// Fitted to the person's bone lengths: those of the skeleton, or of `source_body` with the
    /// file's betas.
    Fit,
    /// The mean body.
    Mean,
}

/// A shape, and the body that the file's `trans` goes with.
pub(super) struct Shape {
    /// Shape coefficients of the body at hand.
    pub betas: Vec<f64>,
    pub origin: ShapeOrigin,
    /// The person's joints on the file's own body, m, where that is another than the one at hand.
    pub source_joints: Option<[Vector3<f64>; JOINT_COUNT]>,
    /// Betas of the file that the body does not have.
    pub betas_left_out: usize,
}

impl Shape {
    pub fn choose(
        path: &Path,
        track: &PoseTrack,
        body: &BodyModel,
        source_body: Option<&Arc<BodyModel>>,
        choice: ShapeChoice,
    ) -> Result<Self, MotionError> {
        let betas = track.mean_betas();
        let checked = body.check_betas(track.shape_space, track.gender, &betas);
        let own = checked.is_ok() && track.shape_space == body.shape_space();
        let mean = || Self {
            betas: vec![0.0; body.beta_count()],
            origin: ShapeOrigin::Mean,
            source_joints: None,
            betas_left_out: 0,
        };
        match (choice, source_body, checked) {
            (ShapeChoice::Mean, ..) => Ok(mean()),
            _ if own => Ok(Self::from_file(betas, body)),
            (ShapeChoice::Detect | ShapeChoice::Fit, Some(source_body), _) => {
                Self::fitted(path, track, &betas, body, source_body)
            }
            (ShapeChoice::File | ShapeChoice::Fit, _, Err(source)) => Err(foreign(path, source)),
            // Zeros, or no betas at all, are the mean of any body.
            _ => Ok(mean()),
        }
    }

    fn from_file(mut betas: Vec<f64>, body: &BodyModel) -> Self {
        let betas_left_out = betas
            .iter()
            .skip(body.beta_count())
            .filter(|&&beta| beta != 0.0)
            .count();
        betas.truncate(body.beta_count());
        Self {
            betas,
            origin: ShapeOrigin::File,
            source_joints: None,
            betas_left_out,
        }
    }

    fn fitted(
        path: &Path,
        track: &PoseTrack,
        betas: &[f64],
        body: &BodyModel,
        source_body: &Arc<BodyModel>,
    ) -> Result<Self, MotionError> {
        source_body
            .check_betas(track.shape_space, track.gender, betas)
            .map_err(|source| foreign(path, source))?;
        let Self {
            betas,
            betas_left_out,
            ..
        } = Self::from_file(betas.to_vec(), source_body);
        let joints = *ShapedBody::new(source_body.clone(), &betas)?.joints_in_model();
        let ShapeFit {
            betas,
            length_rms_m,
        } = body.fit_bone_lengths(|joint| Some(joints[joint.index()]), 1.0);
        Ok(Self {
            betas,
            origin: ShapeOrigin::Fit { length_rms_m },
            source_joints: Some(joints),
            betas_left_out,
        })
    }
}

fn foreign(path: &Path, source: BodyError) -> MotionError {
    MotionError::ForeignShape {
        path: path.to_owned(),
        source: Box::new(source),
    }
}

/// The shape for a skeleton whose rest joints are known.
pub(crate) fn skeleton_betas(
    name: &str,
    choice: ShapeChoice,
    body: &BodyModel,
    joint: impl Fn(Joint) -> Option<Vector3<f64>>,
    metres_per_unit: f64,
) -> Result<ShapeFit, MotionError> {
    match choice {
        ShapeChoice::Detect | ShapeChoice::Fit => Ok(body.fit_bone_lengths(joint, metres_per_unit)),
        ShapeChoice::Mean => Ok(body.mean_for_bone_lengths(joint, metres_per_unit)),
        ShapeChoice::File => Err(MotionError::NoBetas {
            name: name.to_owned(),
        }),
    }
}
