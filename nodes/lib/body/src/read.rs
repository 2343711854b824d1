//! Body model files.

use std::io::{BufReader, Read, Seek};
use std::path::Path;
use std::sync::Arc;

use cromosim_arrays::{Array, ArraysError, Container, Limits};

use crate::kind::{FileModel, Kind, pose_blocks};
use crate::model::{Gender, PoseBlock, RawModel, Rows};
use crate::{BodyError, BodyModel, ShapeSpace};

/// Vertices of the largest mesh that is read; SMPL-X has 10475.
const VERTEX_LIMIT: usize = 100_000;
const TRIANGLE_LIMIT: usize = 2 * VERTEX_LIMIT;
const BETA_LIMIT: usize = 400;

impl BodyModel {
    /// Reads a model file of SMPL, SMPL-H or SMPL-X, npz or pickle (with chumpy and scipy objects
    /// too), told by its content: v_template (V, 3) m, shapedirs (V, 3, B), posedirs (V, 3, 9 (J -
    /// 1)), J_regressor (J, V), weights (V, J), kintree_table (2, J) and f (F, 3) with J = 24, 52
    /// or 55; numbers of any type. Other keys are passed over, `gender` aside. Without it the
    /// gender is read off the name of the file or of its folder, such as `SMPL_FEMALE.npz` and
    /// `female/model.npz`.
    ///
    /// SMPL-H and SMPL-X keep their mesh, shapes and body joints and become bodies of 24 joints.
    /// While fingers, jaw and eyes keep their rest rotation (a flat hand) this is exact. Fingers
    /// follow SMPL's hand joint, placed at the root of the middle finger; jaw and eyes follow the
    /// head; expressions of SMPL-X are left out (its columns from 300 on, or from 10 on of 20).
    ///
    /// # Errors
    /// Every [`BodyError`] that names a path: a file that is cut short, lacks a key, holds wrong
    /// shapes, NaN, or indices out of range.
    pub fn read(path: &Path) -> Result<Arc<Self>, BodyError> {
        let file = std::fs::File::open(path).map_err(|source| {
            BodyError::Arrays(ArraysError::Open {
                path: path.to_owned(),
                source,
            })
        })?;
        Self::from_reader(BufReader::new(file), path)
    }

    /// Like [`Self::read`] from any reader; `path` names it, in errors too.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn from_reader(reader: impl Read + Seek, path: &Path) -> Result<Arc<Self>, BodyError> {
        let mut arrays =
            Container::new(reader, path, Limits::default()).map_err(BodyError::Arrays)?;
        let mut file = read_without_posedirs(&mut arrays)?;
        let (vertex_count, joint_count) = (file.raw.template.len() / 3, file.parents.len());
        let features = 9 * (joint_count - 1);
        let expectation = format!("({vertex_count}, 3, {features}) for {joint_count} joints");
        let posedirs = floats(
            &mut arrays,
            "posedirs",
            &[Some(vertex_count), Some(3), Some(features)],
            &expectation,
        )?;
        file.raw.pose_blocks = pose_blocks(&posedirs.values, joint_count);
        let mut body = Self::from_raw(file.reduced()?)?;
        // The embedded body, exported and read again, keeps its own shapes.
        if body.faces == Self::embedded().faces {
            body.space = ShapeSpace::Cromosim;
        }
        body.sites = crate::transfer::transferred_sites(&body)?;
        Ok(Arc::new(body))
    }
}

fn floats<R: Read + Seek>(
    arrays: &mut Container<R>,
    key: &str,
    expected: &[Option<usize>],
    expectation: &str,
) -> Result<Array<f64>, BodyError> {
    let entry = arrays.at(key).map_err(without_key)?;
    entry
        .floats(expected, expectation)
        .map_err(BodyError::Arrays)
}

fn integers<R: Read + Seek>(
    arrays: &mut Container<R>,
    key: &str,
    expected: &[Option<usize>],
    expectation: &str,
) -> Result<Array<i64>, BodyError> {
    let entry = arrays.at(key).map_err(without_key)?;
    entry
        .integers(expected, expectation)
        .map_err(BodyError::Arrays)
}

/// What a body file lacks is said in terms of bodies.
fn without_key(error: ArraysError) -> BodyError {
    match error {
        ArraysError::MissingKey { path, key, .. } => BodyError::MissingKey { path, key },
        other => BodyError::Arrays(other),
    }
}

/// Everything but the pose blocks and the sites, which stay empty.
pub(crate) fn read_without_posedirs<R: Read + Seek>(
    arrays: &mut Container<R>,
) -> Result<FileModel, BodyError> {
    let path = arrays.path().to_owned();
    let kintree = integers(
        arrays,
        "kintree_table",
        &[Some(2), None],
        "(2, 24), (2, 52) or (2, 55)",
    )?;
    let joint_count = kintree.shape[1];
    let kind = Kind::of_joint_count(joint_count, &path)?;
    let template = floats(arrays, "v_template", &[None, Some(3)], "(V, 3)")?;
    let vertex_count = template.shape[0];
    if !(3..=VERTEX_LIMIT).contains(&vertex_count) {
        return Err(limited(
            &path,
            "v_template",
            &template.shape,
            format!("(V, 3) with V from 3 to {VERTEX_LIMIT}"),
        ));
    }
    let shapedirs = floats(
        arrays,
        "shapedirs",
        &[Some(vertex_count), Some(3), None],
        &format!("({vertex_count}, 3, B)"),
    )?;
    let columns = shapedirs.shape[2];
    if !(1..=BETA_LIMIT).contains(&columns) {
        return Err(limited(
            &path,
            "shapedirs",
            &shapedirs.shape,
            format!("({vertex_count}, 3, B) with B from 1 to {BETA_LIMIT}"),
        ));
    }
    let beta_count = kind.beta_count(columns);
    let shape_directions = shapedirs
        .values
        .chunks_exact(columns)
        .flat_map(|row| &row[..beta_count])
        .copied()
        .collect();
    let regressor = floats(
        arrays,
        "J_regressor",
        &[Some(joint_count), Some(vertex_count)],
        &format!("({joint_count}, {vertex_count})"),
    )?;
    let weights = floats(
        arrays,
        "weights",
        &[Some(vertex_count), Some(joint_count)],
        &format!("({vertex_count}, {joint_count})"),
    )?;
    let faces = integers(arrays, "f", &[None, Some(3)], "(F, 3)")?;
    if !(1..=TRIANGLE_LIMIT).contains(&faces.shape[0]) {
        return Err(limited(
            &path,
            "f",
            &faces.shape,
            format!("(F, 3) with F from 1 to {TRIANGLE_LIMIT}"),
        ));
    }
    let gender = arrays
        .get("gender")
        .map_err(BodyError::Arrays)?
        .and_then(|entry| Gender::from_name(&entry.text().ok()?))
        .or_else(|| gender_in_name(&path));
    let raw = RawModel {
        id: id(&path),
        path,
        space: kind.space(),
        gender,
        template: template.values,
        shape_directions,
        beta_count,
        pose_blocks: Rows::new(std::iter::empty::<Vec<PoseBlock>>()),
        regressor: regressor.values,
        weights: weights.values,
        faces: faces.values,
    };
    Ok(FileModel {
        raw,
        parents: kintree.values[..joint_count].to_vec(),
    })
}

fn stem(path: Option<&Path>) -> Option<String> {
    Some(path?.file_stem()?.to_string_lossy().into_owned())
}

/// The file's stem, with its folder where that alone tells files apart (`female/model.npz`).
fn id(path: &Path) -> String {
    let own = stem(Some(path)).unwrap_or_default();
    match stem(path.parent()) {
        Some(folder) if own == "model" => format!("{folder}/{own}"),
        _ => own,
    }
}

/// `SMPL_FEMALE`, `basicmodel_m_lbs_10_207_0_v1.0.0`, `smplh/male/model`.
fn gender_in_name(path: &Path) -> Option<Gender> {
    let in_name = |name: String| name.split(['_', '-', '.']).find_map(Gender::from_name);
    stem(Some(path))
        .and_then(in_name)
        .or_else(|| stem(path.parent()).and_then(in_name))
}

fn limited(path: &Path, key: &str, shape: &[usize], expected: String) -> BodyError {
    let found = shape.iter().map(|&size| size as u64).collect();
    BodyError::Arrays(ArraysError::Shape {
        path: path.to_owned(),
        key: key.to_owned(),
        found,
        expected,
    })
}
