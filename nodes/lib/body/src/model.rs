//! A body's arrays, checked once: every index and every size is right from here on.

use std::path::Path;
use std::sync::OnceLock;

use nalgebra::Vector3;

use crate::gender::Gender;
use crate::pose_blocks::PoseBlock;
use crate::pose_corrections::PoseBlocks;
use crate::raw::RawModel;
use crate::rows::Rows;
use crate::site::NamedSite;
use crate::skin_tables::SkinTables;
use crate::{BodyError, JOINT_COUNT, ShapeSpace};

/// A body before it has a shape: SMPL (Loper et al. 2015) with V vertices, 24 joints and B shape
/// coefficients.
#[derive(Debug)]
pub struct BodyModel {
    pub(crate) id: String,
    pub(crate) gender: Option<Gender>,
    pub(crate) space: ShapeSpace,
    /// (V, 3), m.
    pub(crate) template: Vec<Vector3<f64>>,
    pub(crate) beta_count: usize,
    /// (V, 3, B), m.
    pub(crate) shape_directions: Vec<f64>,
    pose_blocks: PoseBlocks,
    /// Of each joint, vertices and their weights.
    pub(crate) regressor: Rows<(u32, f64)>,
    /// Of each vertex, joints and their weights.
    pub(crate) skin_weights: Rows<(u8, f64)>,
    pub(crate) faces: Vec<[u32; 3]>,
    pub(crate) sites: Vec<NamedSite>,
    skin_tables: OnceLock<SkinTables>,
}

impl BodyModel {
    /// Checks what shapes alone do not tell, and brings the arrays into the order in which they are
    /// used.
    pub(crate) fn from_raw(raw: RawModel) -> Result<Self, BodyError> {
        let vertex_count = raw.template.len() / 3;
        check_sums(&raw.path, "weights", &raw.weights, JOINT_COUNT)?;
        check_sums(&raw.path, "J_regressor", &raw.regressor, vertex_count)?;
        let faces = checked_faces(&raw.path, &raw.faces, vertex_count)?;
        let template: Vec<_> = raw
            .template
            .as_chunks()
            .0
            .iter()
            .map(|&point: &[f64; 3]| Vector3::from(point))
            .collect();
        let nonzero = |&(_, weight): &(usize, f64)| weight != 0.0;
        let weights = raw.weights.chunks_exact(JOINT_COUNT);
        let skin_weights = Rows::new(weights.map(|row| {
            row.iter()
                .copied()
                .enumerate()
                .filter(nonzero)
                .map(|(joint, weight)| (joint as u8, weight))
        }));
        let regressor = raw.regressor.chunks_exact(vertex_count);
        let regressor = Rows::new(regressor.map(|row| {
            row.iter()
                .copied()
                .enumerate()
                .filter(nonzero)
                .map(|(vertex, weight)| (vertex as u32, weight))
        }));
        Ok(Self {
            id: raw.id,
            gender: raw.gender,
            space: raw.space,
            template,
            beta_count: raw.beta_count,
            shape_directions: raw.shape_directions,
            pose_blocks: raw.pose_blocks,
            regressor,
            skin_weights,
            faces,
            sites: Vec::new(),
            skin_tables: OnceLock::new(),
        })
    }

    /// Of each vertex, the blocks that are not zero.
    pub(crate) fn pose_blocks(&self) -> &Rows<PoseBlock> {
        self.pose_blocks.all(&self.skin_weights)
    }

    /// Those of one vertex.
    pub(crate) fn pose_blocks_of(&self, vertex: usize) -> &[PoseBlock] {
        self.pose_blocks.of_vertex(vertex, &self.skin_weights)
    }

    /// What the skin kernel walks over, made when the mesh is first asked for.
    pub(crate) fn skin_tables(&self) -> &SkinTables {
        let made = || SkinTables::new(self.pose_blocks(), &self.skin_weights, self.vertex_count());
        self.skin_tables.get_or_init(made)
    }

    /// Names the body: `cromosim_neutral` for the embedded one, else the file's stem.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Whom the body was made from, where the file says so.
    pub fn gender(&self) -> Option<Gender> {
        self.gender
    }

    /// Whose shapes the body has: betas of another kind of body do not suit it.
    pub fn shape_space(&self) -> ShapeSpace {
        self.space
    }

    /// The triangles, counter-clockwise seen from outside; every index is below
    /// [`Self::vertex_count`].
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Number of vertices V.
    pub fn vertex_count(&self) -> usize {
        self.template.len()
    }

    /// Number of shape coefficients B.
    pub fn beta_count(&self) -> usize {
        self.beta_count
    }

    /// The rest mesh of the mean shape, (V, 3), m, model frame.
    pub fn template(&self) -> &[Vector3<f64>] {
        &self.template
    }

    /// Rest joints are linear in betas: J(beta) = J(0) + sum_b beta_b D_b. These are J(0) and the
    /// D_b, (24, 3) each, m: what a fit of betas to bone lengths needs.
    pub fn joint_shape_directions(
        &self,
    ) -> (
        [Vector3<f64>; JOINT_COUNT],
        Vec<[Vector3<f64>; JOINT_COUNT]>,
    ) {
        let at = |value: &dyn Fn(usize) -> Vector3<f64>| -> [Vector3<f64>; JOINT_COUNT] {
            std::array::from_fn(|joint| {
                self.regressor
                    .row(joint)
                    .iter()
                    .map(|&(vertex, weight)| value(vertex as usize) * weight)
                    .sum()
            })
        };
        let direction = |vertex: usize, beta: usize| {
            Vector3::from_fn(|axis, _| {
                self.shape_directions[(3 * vertex + axis) * self.beta_count + beta]
            })
        };
        let mean = at(&|vertex| self.template[vertex]);
        (
            mean,
            (0..self.beta_count)
                .map(|beta| at(&|vertex| direction(vertex, beta)))
                .collect(),
        )
    }
}

/// Rows of `width` must sum to one within 1e-3: float32 files are within 1e-6, and a body whose
/// weights do not would tear apart.
fn check_sums(path: &Path, key: &str, values: &[f64], width: usize) -> Result<(), BodyError> {
    for (row, values) in values.chunks_exact(width).enumerate() {
        let sum: f64 = values.iter().sum();
        if (sum - 1.0).abs() > 1e-3 {
            return Err(BodyError::WeightSum {
                path: path.to_owned(),
                key: key.to_owned(),
                row,
                sum,
            });
        }
    }
    Ok(())
}

fn checked_faces(
    path: &Path,
    faces: &[i64],
    vertex_count: usize,
) -> Result<Vec<[u32; 3]>, BodyError> {
    if let Some(corner) = faces
        .iter()
        .position(|&vertex| vertex < 0 || vertex >= vertex_count as i64)
    {
        return Err(BodyError::TriangleVertex {
            path: path.to_owned(),
            triangle: corner / 3,
            vertex: faces[corner],
            vertex_count,
        });
    }
    Ok(faces
        .as_chunks()
        .0
        .iter()
        .map(|corners: &[i64; 3]| corners.map(|vertex| vertex as u32))
        .collect())
}
