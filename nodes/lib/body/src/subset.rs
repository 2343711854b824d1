//! A few vertices in f64: all that a virtual sensor needs of the mesh.

use nalgebra::{Isometry3, Vector3};
use pulp::{Scalar, Simd, WithSimd};

use crate::lanes::{
    IsometryLanes, RotationLanes, VectorLanes, difference, gathered, isometry_of, matrix_less_one,
    product, rotated, scaled, splat, sum, vector_of,
};
use crate::pose_blocks::PoseBlock;
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
    /// Whose rotation anything depends on.
    turning: Vec<Joint>,
}

#[derive(Clone, Debug)]
struct SubsetVertex {
    index: u32,
    rest: Vector3<f64>,
    corrections: Vec<Correction>,
    skin_weights: Vec<(u8, f64)>,
}

/// A [`PoseBlock`] in the order in which it is summed: x, y, z of each element of R - I.
#[derive(Clone, Debug)]
struct Correction {
    joint: u8,
    coefficients: [Vector3<f64>; 9],
}

impl From<&PoseBlock> for Correction {
    fn from(block: &PoseBlock) -> Self {
        let [x, y, z] = [0, 1, 2].map(|axis| &block.coefficients[9 * axis..9 * (axis + 1)]);
        let of_element = |i: usize| Vector3::new(x[i], y[i], z[i]).map(f64::from);
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
            turning: Joint::ALL.to_vec(),
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
        let (joints, correcting) = (&self.joints, &self.correcting);
        let turns = |joint: &Joint| joints.contains(joint) || correcting.contains(joint);
        self.turning = Joint::ALL.into_iter().filter(turns).collect();
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
        let mut evaluated = PosesInLanes::new(Scalar::new(), self.vertices.len());
        self.evaluate(Scalar::new(), std::slice::from_ref(pose), &mut evaluated);
        positions.clear();
        let vectors = evaluated.positions.iter();
        positions.extend(vectors.map(|it| vector_of::<Scalar>(it, 0)));
        let mut segments = [Isometry3::identity(); JOINT_COUNT];
        for joint in &self.joints {
            let segment = &evaluated.world_from_segments[joint.index()];
            segments[joint.index()] = isometry_of::<Scalar>(segment, 0);
        }
        segments
    }

    /// As [`Self::positions_and_segments_into`] of each pose, as many at once as the processor has
    /// lanes.
    pub fn visit_poses(&self, poses: &[BodyPose], visitor: impl VisitPoses) {
        pulp::Arch::new().dispatch(Walk {
            subset: self,
            poses,
            visitor,
        });
    }

    /// As many poses as there are lanes, or fewer: the last stands in the lanes that are left.
    #[inline(always)]
    fn evaluate<S: Simd>(&self, s: S, poses: &[BodyPose], evaluated: &mut PosesInLanes<S>) {
        let pose = |lane: usize| &poses[lane.min(poses.len() - 1)];
        let PosesInLanes {
            local_rotations,
            features,
            world_from_segments,
            positions,
            count,
        } = evaluated;
        *count = poses.len();
        for joint in &self.turning {
            local_rotations[joint.index()] = std::array::from_fn(|component| {
                gathered(s, |lane| {
                    pose(lane).local_rotations[joint.index()].coords[component]
                })
            });
        }
        let root = std::array::from_fn(|axis| gathered(s, |lane| pose(lane).root_position[axis]));
        self.segments(s, local_rotations, &root, world_from_segments);
        for joint in &self.correcting {
            features[joint.index()] = matrix_less_one(s, &local_rotations[joint.index()]);
        }
        for (vertex, position) in self.vertices.iter().zip(positions) {
            let correction = correction(s, &vertex.corrections, features);
            let corrected = sum(s, &splat(s, &vertex.rest), &correction);
            let mut about_root = [s.splat_f64s(0.0); 3];
            for &(joint, weight) in &vertex.skin_weights {
                let in_model = splat(s, &self.joints_in_model[joint as usize]);
                let (rotation, translation) = &world_from_segments[joint as usize];
                let turned = rotated(s, rotation, &difference(s, &corrected, &in_model));
                // About the root: weights sum to 1 within 1e-7 only, which must not grow with the
                // distance walked.
                let moved = sum(s, &turned, &difference(s, translation, &root));
                let weighted = scaled(s, &moved, s.splat_f64s(weight));
                about_root = sum(s, &about_root, &weighted);
            }
            *position = sum(s, &root, &about_root);
        }
    }

    /// As `ShapedBody::world_from_segments`, of the joints that are evaluated.
    #[inline(always)]
    fn segments<S: Simd>(
        &self,
        s: S,
        rotations: &[RotationLanes<S>; JOINT_COUNT],
        root: &VectorLanes<S>,
        world_from: &mut [IsometryLanes<S>; JOINT_COUNT],
    ) {
        world_from[0] = (rotations[0], *root);
        for joint in &self.joints {
            if let Some(parent) = joint.parent() {
                let joints = &self.joints_in_model;
                let in_parent = joints[joint.index()] - joints[parent.index()];
                let (rotation, translation) = &world_from[parent.index()];
                let shift = rotated(s, rotation, &splat(s, &in_parent));
                world_from[joint.index()] = (
                    product(s, rotation, &rotations[joint.index()]),
                    sum(s, translation, &shift),
                );
            }
        }
    }
}

/// Poses beside each other, one in each lane.
#[derive(Clone, Debug)]
pub struct PosesInLanes<S: Simd> {
    local_rotations: [RotationLanes<S>; JOINT_COUNT],
    /// R - I of the joints that correct.
    features: [[S::f64s; 9]; JOINT_COUNT],
    /// Of the joints that are evaluated.
    world_from_segments: [IsometryLanes<S>; JOINT_COUNT],
    positions: Vec<VectorLanes<S>>,
    count: usize,
}

impl<S: Simd> PosesInLanes<S> {
    #[inline(always)]
    fn new(s: S, vertex_count: usize) -> Self {
        let zero = s.splat_f64s(0.0);
        Self {
            local_rotations: [[zero; 4]; JOINT_COUNT],
            features: [[zero; 9]; JOINT_COUNT],
            world_from_segments: [([zero; 4], [zero; 3]); JOINT_COUNT],
            positions: vec![[zero; 3]; vertex_count],
            count: 0,
        }
    }

    /// How many lanes hold a pose of their own; what the others hold means nothing.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The subset's vertices in the world, m, in its order.
    pub fn positions(&self) -> &[VectorLanes<S>] {
        &self.positions
    }

    /// A joint's segment (m), which [`VertexSubset::with_segments_of`] was asked for.
    pub fn world_from_segment(&self, joint: Joint) -> &IsometryLanes<S> {
        &self.world_from_segments[joint.index()]
    }
}

/// What is done with poses that stand beside each other; written `#[inline(always)]`, so that it is
/// compiled for the processor whose lanes it is given.
pub trait VisitPoses {
    /// `first` is the number of the pose in lane 0, the others follow it.
    fn visit<S: Simd>(&mut self, s: S, first: usize, poses: &PosesInLanes<S>);
}

/// [`VertexSubset::visit_poses`], to be compiled for each kind of processor.
struct Walk<'a, V> {
    subset: &'a VertexSubset,
    poses: &'a [BodyPose],
    visitor: V,
}

impl<V: VisitPoses> WithSimd for Walk<'_, V> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, s: S) {
        let mut evaluated = PosesInLanes::new(s, self.subset.vertices.len());
        for (number, poses) in self.poses.chunks(S::F64_LANES).enumerate() {
            self.subset.evaluate(s, poses, &mut evaluated);
            self.visitor.visit(s, number * S::F64_LANES, &evaluated);
        }
    }
}

/// P vec(R - I) of one vertex, m.
#[inline(always)]
fn correction<S: Simd>(
    s: S,
    corrections: &[Correction],
    features: &[[S::f64s; 9]; JOINT_COUNT],
) -> VectorLanes<S> {
    let mut all = [s.splat_f64s(0.0); 3];
    for Correction {
        joint,
        coefficients,
    } in corrections
    {
        let mut of_joint = [s.splat_f64s(0.0); 3];
        for (coefficients, feature) in coefficients.iter().zip(&features[*joint as usize]) {
            let of_feature = scaled(s, &splat(s, coefficients), *feature);
            of_joint = sum(s, &of_joint, &of_feature);
        }
        all = sum(s, &all, &of_joint);
    }
    all
}
