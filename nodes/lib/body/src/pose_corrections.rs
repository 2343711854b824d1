//! Pose corrections of all vertices, or of those that are asked for.

use std::sync::OnceLock;

use crate::pose_blocks::PoseBlock;
use crate::posedirs::ClosedForm;
use crate::rows::Rows;

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
