//! A few vertices in f64: all that a virtual sensor needs of the mesh.

use nalgebra::{Isometry3, Vector3};

use crate::pose_blocks::PoseBlock;
use crate::shape::forward_kinematics;
use crate::{BodyError, BodyPose, JOINT_COUNT, Joint, ShapedBody};

/// Some vertices of a shaped body; holds only what these need.
#[derive(Clone, Debug)]
pub struct VertexSubset {
    joints_in_model: [Vector3<f64>; JOINT_COUNT],
    vertices: Vec<SubsetVertex>,
    /// Whose segments are evaluated, each after its parent.
    joints: Vec<Joint>,
    /// Whose rotation the vertices' corrections depend on.
    correcting: Vec<Joint>,
}

#[derive(Clone, Debug)]
struct SubsetVertex {
    index: u32,
    rest: Vector3<f64>,
    corrections: Vec<Correction>,
    skin_weights: Vec<(u8, f64)>,
}

/// A [`PoseBlock`] in the order in which it is summed: x, y, z and nothing of each element of R - I.
#[derive(Clone, Debug)]
struct Correction {
    joint: u8,
    coefficients: [[f64; 4]; 9],
}

impl From<&PoseBlock> for Correction {
    fn from(block: &PoseBlock) -> Self {
        let [x, y, z] = [0, 1, 2].map(|axis| &block.coefficients[9 * axis..9 * (axis + 1)]);
        let of_element = |i: usize| [x[i], y[i], z[i], 0.0].map(f64::from);
        Self {
            joint: block.joint,
            coefficients: std::array::from_fn(of_element),
        }
    }
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
                corrections: model
                    .pose_blocks_of(vertex)
                    .iter()
                    .map(Correction::from)
                    .collect(),
                skin_weights: model.skin_weights.row(vertex).to_vec(),
            })
        };
        let vertices: Vec<SubsetVertex> =
            vertices.iter().map(of_vertex).collect::<Result<_, _>>()?;
        let corrections = || vertices.iter().flat_map(|vertex| &vertex.corrections);
        let corrects = |joint: &Joint| corrections().any(|it| it.joint as usize == joint.index());
        Ok(VertexSubset {
            joints_in_model: *self.joints_in_model(),
            joints: Joint::ALL.to_vec(),
            correcting: Joint::ALL.into_iter().filter(corrects).collect(),
            vertices,
        })
    }
}

impl VertexSubset {
    /// Evaluates no more segments than those of these joints and those that the vertices hang on; the
    /// others are said to be the identity.
    #[must_use]
    pub fn with_segments_of(mut self, joints: impl IntoIterator<Item = Joint>) -> Self {
        let mut wanted = [false; JOINT_COUNT];
        joints
            .into_iter()
            .for_each(|joint| wanted[joint.index()] = true);
        let weights = self.vertices.iter().flat_map(|vertex| &vertex.skin_weights);
        weights.for_each(|(joint, _)| wanted[*joint as usize] = true);
        // Parents stand before their children.
        for joint in Joint::ALL.into_iter().rev() {
            if let Some(parent) = joint.parent() {
                wanted[parent.index()] |= wanted[joint.index()];
            }
        }
        self.joints = Joint::ALL
            .into_iter()
            .filter(|joint| wanted[joint.index()])
            .collect();
        self
    }

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

    /// As [`Self::positions_into`], and returns the skeleton that was evaluated on the way, see
    /// [`Self::with_segments_of`].
    pub fn positions_and_segments_into(
        &self,
        pose: &BodyPose,
        positions: &mut Vec<Vector3<f64>>,
    ) -> [Isometry3<f64>; JOINT_COUNT] {
        let world_from_segments = forward_kinematics(&self.joints_in_model, &self.joints, pose);
        let root_position = pose.root_position;
        let mut features = [[0.0; 9]; JOINT_COUNT];
        for joint in &self.correcting {
            let matrix = pose.local_rotations[joint.index()].to_rotation_matrix();
            features[joint.index()] = std::array::from_fn(|i| {
                matrix[(i / 3, i % 3)] - if i / 3 == i % 3 { 1.0 } else { 0.0 }
            });
        }
        positions.clear();
        positions.extend(self.vertices.iter().map(|vertex| {
            let corrected = vertex.rest + correction(&vertex.corrections, &features);
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
fn correction(corrections: &[Correction], features: &[[f64; 9]; JOINT_COUNT]) -> Vector3<f64> {
    let mut all = Vector3::zeros();
    for Correction {
        joint,
        coefficients,
    } in corrections
    {
        let mut of_joint = [0.0; 4];
        for (coefficients, feature) in coefficients.iter().zip(&features[*joint as usize]) {
            for (sum, coefficient) in of_joint.iter_mut().zip(coefficients) {
                *sum += coefficient * feature;
            }
        }
        let [x, y, z, _] = of_joint;
        all += Vector3::new(x, y, z);
    }
    all
}
