//! A body with a shape: rest mesh and skeleton.

use std::sync::{Arc, OnceLock};

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::skin_tables::RestTiles;
use crate::{BodyError, BodyModel, BodyPose, JOINT_COUNT, Joint};

/// A body model with the shape of one person.
#[derive(Clone, Debug)]
pub struct ShapedBody {
    model: Arc<BodyModel>,
    betas: Vec<f64>,
    rest_vertices: Vec<Vector3<f64>>,
    joints_in_model: [Vector3<f64>; JOINT_COUNT],
    rest_tiles: OnceLock<RestTiles>,
}

impl ShapedBody {
    /// Shapes `model`: vertices v = v_template + shapedirs betas (V, 3) and joints J = J_regressor
    /// v (24, 3), m (SMPL, Loper et al. 2015, eq. 8 and 10). Fewer betas than the model has are
    /// filled up with 0.
    ///
    /// # Errors
    /// [`BodyError::TooManyBetas`], [`BodyError::BetaNotFinite`].
    pub fn new(model: Arc<BodyModel>, betas: &[f64]) -> Result<Self, BodyError> {
        let available = model.beta_count();
        if betas.len() > available {
            return Err(BodyError::TooManyBetas {
                body: model.id().to_owned(),
                given: betas.len(),
                available,
            });
        }
        if let Some(index) = betas.iter().position(|beta| !beta.is_finite()) {
            return Err(BodyError::BetaNotFinite {
                index,
                value: betas[index],
            });
        }
        let directions = model.shape_directions.chunks_exact(3 * available);
        let shaped = |(mean, directions): (&Vector3<f64>, &[f64])| {
            mean + Vector3::from_fn(|axis, _| {
                betas
                    .iter()
                    .zip(&directions[axis * available..])
                    .map(|(beta, s)| beta * s)
                    .sum()
            })
        };
        let rest_vertices: Vec<Vector3<f64>> =
            model.template.iter().zip(directions).map(shaped).collect();
        let joints_in_model = std::array::from_fn(|joint| {
            model
                .regressor
                .row(joint)
                .iter()
                .map(|&(vertex, weight)| rest_vertices[vertex as usize] * weight)
                .sum()
        });
        Ok(Self {
            betas: betas.to_vec(),
            rest_vertices,
            joints_in_model,
            rest_tiles: OnceLock::new(),
            model,
        })
    }

    /// The mesh at rest as the skin kernel wants it: see `skin_tables.rs`.
    pub(crate) fn rest_tiles(&self) -> &RestTiles {
        let tiled = || self.model.skin_tables().tiled(&self.rest_vertices);
        self.rest_tiles.get_or_init(tiled)
    }

    /// The model that was shaped.
    pub fn model(&self) -> &Arc<BodyModel> {
        &self.model
    }

    /// The shape coefficients as given.
    pub fn betas(&self) -> &[f64] {
        &self.betas
    }

    /// The joints at rest, (24, 3), m, model frame.
    pub fn joints_in_model(&self) -> &[Vector3<f64>; JOINT_COUNT] {
        &self.joints_in_model
    }

    /// The mesh at rest (T-pose), (V, 3), m, model frame.
    pub fn rest_vertices(&self) -> &[Vector3<f64>] {
        &self.rest_vertices
    }

    /// The pelvis joint in the world for SMPL's `trans`: J_0(beta) + trans, since SMPL turns about
    /// J_0 and moves afterwards.
    pub fn root_position(&self, trans: Vector3<f64>) -> Vector3<f64> {
        self.joints_in_model[0] + trans
    }

    /// SMPL's `trans` for a root position: the inverse of [`Self::root_position`].
    pub fn trans(&self, root_position: Vector3<f64>) -> Vector3<f64> {
        root_position - self.joints_in_model[0]
    }

    /// world_from_segment of every joint (SMPL eq. 4): G_0 = [R_0 | root], G_j = G_parent [R_j |
    /// J_j - J_parent].
    pub fn world_from_segments(&self, pose: &BodyPose) -> [Isometry3<f64>; JOINT_COUNT] {
        forward_kinematics(&self.joints_in_model, &Joint::ALL, pose)
    }
}

/// As [`ShapedBody::world_from_segments`], from the rest joints alone, of some joints: each after its
/// parent. The others' segments are the identity.
pub(crate) fn forward_kinematics(
    joints_in_model: &[Vector3<f64>; JOINT_COUNT],
    joints: &[Joint],
    pose: &BodyPose,
) -> [Isometry3<f64>; JOINT_COUNT] {
    let mut world_from_segments = [Isometry3::identity(); JOINT_COUNT];
    for joint in joints.iter().copied() {
        let rotation: UnitQuaternion<f64> = pose.local_rotations[joint.index()];
        world_from_segments[joint.index()] = match joint.parent() {
            None => Isometry3::from_parts(Translation3::from(pose.root_position), rotation),
            Some(parent) => {
                let joint_in_parent =
                    joints_in_model[joint.index()] - joints_in_model[parent.index()];
                world_from_segments[parent.index()]
                    * Isometry3::from_parts(Translation3::from(joint_in_parent), rotation)
            }
        };
    }
    world_from_segments
}
