//! A few vertices in f64: all that a virtual sensor needs of the mesh.

use nalgebra::{Isometry3, Vector3};

use crate::pose_blocks::PoseBlock;
use crate::shape::forward_kinematics;
use crate::{BodyError, BodyPose, JOINT_COUNT, ShapedBody};

/// Some vertices of a shaped body; holds only what these need.
#[derive(Clone, Debug)]
pub struct VertexSubset {
    joints_in_model: [Vector3<f64>; JOINT_COUNT],
    vertices: Vec<SubsetVertex>,
}

#[derive(Clone, Debug)]
struct SubsetVertex {
    index: u32,
    rest: Vector3<f64>,
    pose_blocks: Vec<PoseBlock>,
    skin_weights: Vec<(u8, f64)>,
}

impl ShapedBody {
    /// The vertices to evaluate, in this order; repeated ones stay repeated.
    ///
    /// # Errors
    /// [`BodyError::UnknownVertex`].
    pub fn subset(&self, vertices: &[u32]) -> Result<VertexSubset, BodyError> {
        let model = self.model();
        let of_vertex = |&index: &u32| {
            let vertex = index as usize;
            let unknown = || BodyError::UnknownVertex {
                body: model.id().to_owned(),
                vertex: index,
                vertex_count: model.vertex_count(),
            };
            Ok(SubsetVertex {
                index,
                rest: *self.rest_vertices().get(vertex).ok_or_else(unknown)?,
                pose_blocks: model.pose_blocks.row(vertex).to_vec(),
                skin_weights: model.skin_weights.row(vertex).to_vec(),
            })
        };
        Ok(VertexSubset {
            joints_in_model: *self.joints_in_model(),
            vertices: vertices.iter().map(of_vertex).collect::<Result<_, _>>()?,
        })
    }
}

impl VertexSubset {
    /// The vertices' indices, in the order of the positions.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        self.vertices.iter().map(|vertex| vertex.index)
    }

    /// The vertices in the world, m (SMPL, Loper et al. 2015, eq. 2 and 9):
    /// v = sum_j w_j G_j (rest + P vec(R_1..23 - I) - J_j), where G_j is world_from_segment.
    pub fn positions(&self, pose: &BodyPose) -> Vec<Vector3<f64>> {
        let mut positions = Vec::new();
        self.positions_into(pose, &mut positions);
        positions
    }

    /// As [`Self::positions`], into a vector that is used again.
    pub fn positions_into(&self, pose: &BodyPose, positions: &mut Vec<Vector3<f64>>) {
        self.positions_and_segments_into(pose, positions);
    }

    /// As [`Self::positions_into`], and returns the skeleton that was evaluated on the way.
    pub fn positions_and_segments_into(
        &self,
        pose: &BodyPose,
        positions: &mut Vec<Vector3<f64>>,
    ) -> [Isometry3<f64>; JOINT_COUNT] {
        let world_from_segments = forward_kinematics(&self.joints_in_model, pose);
        let root_position = pose.root_position;
        let features = pose.local_rotations.map(|rotation| {
            let matrix = rotation.to_rotation_matrix();
            std::array::from_fn(|i| matrix[(i / 3, i % 3)] - if i / 3 == i % 3 { 1.0 } else { 0.0 })
        });
        positions.clear();
        positions.extend(self.vertices.iter().map(|vertex| {
            let corrected = vertex.rest + correction(&vertex.pose_blocks, &features);
            let moved = |&(joint, weight): &(u8, f64)| {
                let in_segment = corrected - self.joints_in_model[joint as usize];
                let world_from_segment = &world_from_segments[joint as usize];
                // About the root: weights sum to 1 within 1e-7 only, which must not grow with the
                // distance walked.
                (world_from_segment.rotation * in_segment
                    + (world_from_segment.translation.vector - root_position))
                    * weight
            };
            root_position + vertex.skin_weights.iter().map(moved).sum::<Vector3<f64>>()
        }));
        world_from_segments
    }
}

/// P vec(R - I) of one vertex, m.
fn correction(blocks: &[PoseBlock], features: &[[f64; 9]; JOINT_COUNT]) -> Vector3<f64> {
    let mut correction = Vector3::zeros();
    for block in blocks {
        for (axis, row) in block.coefficients.as_chunks::<9>().0.iter().enumerate() {
            let products = row
                .iter()
                .zip(&features[block.joint as usize])
                .map(|(c, feature)| f64::from(*c) * feature);
            correction[axis] += products.sum::<f64>();
        }
    }
    correction
}
