//! The sparse form of SMPL's posedirs.

use std::sync::OnceLock;

use crate::JOINT_COUNT;
use crate::joint::SHARED_JOINTS;
use crate::posedirs::ClosedForm;
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

/// Of each vertex, the blocks that are not zero. Those in closed form are made where they are asked for:
/// sensors need some vertices, and all of them take longer than minutes of motion.
#[derive(Debug)]
pub(crate) struct PoseBlocks {
    all: OnceLock<Rows<PoseBlock>>,
    /// Where they are in closed form: that, and of each vertex what was asked for.
    closed_form: Option<(ClosedForm, Vec<OnceLock<Vec<PoseBlock>>>)>,
}

impl From<Rows<PoseBlock>> for PoseBlocks {
    fn from(all: Rows<PoseBlock>) -> Self {
        Self {
            all: all.into(),
            closed_form: None,
        }
    }
}

impl From<ClosedForm> for PoseBlocks {
    fn from(closed_form: ClosedForm) -> Self {
        let made = vec![OnceLock::new(); closed_form.vertex_count()];
        Self {
            all: OnceLock::new(),
            closed_form: Some((closed_form, made)),
        }
    }
}

impl PoseBlocks {
    /// Those of a vertex, on a body with these skin weights.
    pub fn of_vertex(&self, vertex: usize, skin_weights: &Rows<(u8, f64)>) -> &[PoseBlock] {
        match (self.all.get(), &self.closed_form) {
            (None, Some((form, made))) => {
                made[vertex].get_or_init(|| form.of_vertex(vertex, skin_weights.row(vertex)))
            }
            _ => self.all(skin_weights).row(vertex),
        }
    }

    /// Those of all vertices.
    pub fn all(&self, skin_weights: &Rows<(u8, f64)>) -> &Rows<PoseBlock> {
        self.all.get_or_init(|| {
            let rows = self.closed_form.iter().flat_map(|(form, _)| {
                let vertices = skin_weights.rows().enumerate();
                vertices.map(|(vertex, weights)| form.of_vertex(vertex, weights))
            });
            Rows::new(rows)
        })
    }
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
