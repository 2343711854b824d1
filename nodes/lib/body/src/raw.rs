//! The arrays of a body file before they are checked.

use std::path::PathBuf;

use crate::ShapeSpace;
use crate::gender::Gender;
use crate::pose_corrections::PoseBlocks;

/// The dense arrays of a body file, shapes checked by the reader and values not yet.
pub(crate) struct RawModel {
    /// Names the file in errors.
    pub path: PathBuf,
    pub id: String,
    pub space: ShapeSpace,
    pub gender: Option<Gender>,
    /// (V, 3).
    pub template: Vec<f64>,
    /// (V, 3, B).
    pub shape_directions: Vec<f64>,
    pub beta_count: usize,
    pub pose_blocks: PoseBlocks,
    /// (24, V).
    pub regressor: Vec<f64>,
    /// (V, 24).
    pub weights: Vec<f64>,
    /// (F, 3).
    pub faces: Vec<i64>,
}
