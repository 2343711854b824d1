//! The sparse form of SMPL's posedirs.

use crate::JOINT_COUNT;
use crate::joint::SHARED_JOINTS;
use crate::rows::Rows;

/// What one joint's rotation adds to one vertex: `coefficients[9 * axis + 3 * row + column]` times
/// (R - I)[row, column].
///
/// f32: corrections are centimetres, so that rounding stays under a nanometre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PoseBlock {
    /// The joint, 1 to 23.
    pub joint: u8,
    /// Row-major over (3 axes, 3 rows, 3 columns), m.
    pub coefficients: [f32; 27],
}

/// Of posedirs (V, 3, 9 (J - 1)), each vertex' blocks (3, 9) of SMPL's joints that are not zero.
pub(crate) fn pose_blocks(directions: &[f64], joint_count: usize) -> Rows<PoseBlock> {
    let features = 9 * (joint_count - 1);
    Rows::new(
        directions
            .chunks_exact(3 * features)
            .map(|directions| vertex_pose_blocks(directions, joint_count)),
    )
}

/// As [`pose_blocks`], of one vertex.
pub(crate) fn vertex_pose_blocks(directions: &[f64], joint_count: usize) -> Vec<PoseBlock> {
    let features = 9 * (joint_count - 1);
    let joints = if joint_count == JOINT_COUNT {
        JOINT_COUNT
    } else {
        SHARED_JOINTS
    };
    let block = |joint: usize| PoseBlock {
        joint: joint as u8,
        coefficients: std::array::from_fn(|i| {
            directions[(i / 9) * features + 9 * (joint - 1) + i % 9] as f32
        }),
    };
    (1..joints)
        .map(block)
        .filter(|block| block.coefficients.iter().any(|&c| c != 0.0))
        .collect()
}
