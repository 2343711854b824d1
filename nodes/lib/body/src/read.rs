//! SMPL model files in npz layout.

use std::io::{BufReader, Read, Seek};
use std::path::Path;
use std::sync::Arc;

use crate::model::{Gender, PoseBlock, RawModel, Rows};
use crate::npz::{Array, NpzReader};
use crate::{BodyError, BodyModel, JOINT_COUNT};

/// Vertices of the largest mesh that is read; SMPL-X has 10475.
const VERTEX_LIMIT: usize = 100_000;
const TRIANGLE_LIMIT: usize = 2 * VERTEX_LIMIT;
const BETA_LIMIT: usize = 400;
const POSE_FEATURES: usize = 9 * (JOINT_COUNT - 1);

impl BodyModel {
    /// Reads an SMPL model: an npz with v_template (V, 3) m, shapedirs (V, 3, B), posedirs (V, 3, 207), J_regressor (24, V),
    /// weights (V, 24), kintree_table (2, 24) and f (F, 3); float32 or float64, integers of any width. Other keys are passed over,
    /// `gender` aside. Without it the gender is read off a file name such as `SMPL_FEMALE.npz`.
    ///
    /// # Errors
    /// Every [`BodyError`] that names a path: a file that is cut short, lacks a key, holds wrong shapes, NaN, or indices out of range.
    pub fn read_npz(path: &Path) -> Result<Arc<Self>, BodyError> {
        let file = std::fs::File::open(path).map_err(|source| BodyError::Open { path: path.to_owned(), source })?;
        Self::from_npz(BufReader::new(file), path)
    }

    /// Like [`Self::read_npz`] from any reader; `path` names it, in errors too.
    ///
    /// # Errors
    /// As [`Self::read_npz`].
    pub fn from_npz(reader: impl Read + Seek, path: &Path) -> Result<Arc<Self>, BodyError> {
        let mut npz = NpzReader::new(reader, path)?;
        let posedirs = read_posedirs(&mut npz, path)?;
        let mut raw = read_without_posedirs(&mut npz, path)?;
        if posedirs.shape[0] * 3 != raw.template.len() {
            let expected = format!("({}, 3, {POSE_FEATURES})", raw.template.len() / 3);
            let found = posedirs.shape.iter().map(|&size| size as u64).collect();
            return Err(BodyError::Shape { path: path.to_owned(), key: "posedirs".to_owned(), found, expected });
        }
        raw.pose_blocks = Rows::new(posedirs.values.chunks_exact(3 * POSE_FEATURES).map(pose_blocks));
        let mut body = Self::from_raw(raw)?;
        body.sites = crate::site::transferred_sites(&body)?;
        Ok(Arc::new(body))
    }
}

/// posedirs come first: their last dimension says which kind of body this is.
fn read_posedirs<R: Read + Seek>(npz: &mut NpzReader<R>, path: &Path) -> Result<Array<f64>, BodyError> {
    match npz.floats("posedirs", &[None, Some(3), Some(POSE_FEATURES)], "(V, 3, 207)") {
        Err(BodyError::Shape { found, .. }) if found.len() == 3 && found[2] == 9 * 51 => {
            Err(BodyError::BodyType { path: path.to_owned(), columns: found[2], found: "SMPL-H" })
        }
        Err(BodyError::Shape { found, .. }) if found.len() == 3 && found[2] == 9 * 54 => {
            Err(BodyError::BodyType { path: path.to_owned(), columns: found[2], found: "SMPL-X" })
        }
        read => read?.ok_or_else(|| missing(path, "posedirs")),
    }
}

/// Everything but the pose blocks and the sites, which stay empty.
pub(crate) fn read_without_posedirs<R: Read + Seek>(npz: &mut NpzReader<R>, path: &Path) -> Result<RawModel, BodyError> {
    let template = npz.floats("v_template", &[None, Some(3)], "(V, 3)")?.ok_or_else(|| missing(path, "v_template"))?;
    let vertex_count = template.shape[0];
    if !(3..=VERTEX_LIMIT).contains(&vertex_count) {
        return Err(limited(path, "v_template", &template.shape, format!("(V, 3) with V from 3 to {VERTEX_LIMIT}")));
    }
    let mut floats = |key: &str, expected: &[Option<usize>], expectation: String| {
        npz.floats(key, expected, &expectation)?.ok_or_else(|| missing(path, key))
    };
    let shapedirs = floats("shapedirs", &[Some(vertex_count), Some(3), None], format!("({vertex_count}, 3, B)"))?;
    let beta_count = shapedirs.shape[2];
    if !(1..=BETA_LIMIT).contains(&beta_count) {
        return Err(limited(path, "shapedirs", &shapedirs.shape, format!("({vertex_count}, 3, B) with B from 1 to {BETA_LIMIT}")));
    }
    let regressor = floats("J_regressor", &[Some(JOINT_COUNT), Some(vertex_count)], format!("({JOINT_COUNT}, {vertex_count})"))?;
    let weights = floats("weights", &[Some(vertex_count), Some(JOINT_COUNT)], format!("({vertex_count}, {JOINT_COUNT})"))?;
    let mut integers = |key: &str, expected: &[Option<usize>], expectation: &str| {
        npz.integers(key, expected, expectation)?.ok_or_else(|| missing(path, key))
    };
    let kintree = integers("kintree_table", &[Some(2), Some(JOINT_COUNT)], "(2, 24)")?;
    let faces = integers("f", &[None, Some(3)], "(F, 3)")?;
    if !(1..=TRIANGLE_LIMIT).contains(&faces.shape[0]) {
        return Err(limited(path, "f", &faces.shape, format!("(F, 3) with F from 1 to {TRIANGLE_LIMIT}")));
    }
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let gender = npz.text("gender")?.and_then(|name| Gender::from_name(&name)).or_else(|| gender_in_file_name(&stem));
    Ok(RawModel {
        path: path.to_owned(),
        id: stem,
        gender,
        template: template.values,
        shape_directions: shapedirs.values,
        beta_count,
        pose_blocks: Rows::new(std::iter::empty::<Vec<PoseBlock>>()),
        regressor: regressor.values,
        weights: weights.values,
        parents: kintree.values[..JOINT_COUNT].to_vec(),
        faces: faces.values,
    })
}

/// Of one vertex' posedirs (3, 207), the joints' blocks (3, 9) that are not zero.
pub(crate) fn pose_blocks(directions: &[f64]) -> Vec<PoseBlock> {
    let block = |joint: usize| PoseBlock {
        joint: joint as u8,
        coefficients: std::array::from_fn(|i| directions[(i / 9) * POSE_FEATURES + 9 * (joint - 1) + i % 9] as f32),
    };
    (1..JOINT_COUNT).map(block).filter(|block| block.coefficients.iter().any(|&c| c != 0.0)).collect()
}

/// `SMPL_FEMALE`, `basicmodel_m_lbs_10_207_0_v1.0.0`.
fn gender_in_file_name(stem: &str) -> Option<Gender> {
    stem.split(['_', '-', '.']).find_map(Gender::from_name)
}

fn missing(path: &Path, key: &str) -> BodyError {
    BodyError::MissingKey { path: path.to_owned(), key: key.to_owned() }
}

fn limited(path: &Path, key: &str, shape: &[usize], expected: String) -> BodyError {
    BodyError::Shape { path: path.to_owned(), key: key.to_owned(), found: shape.iter().map(|&size| size as u64).collect(), expected }
}
