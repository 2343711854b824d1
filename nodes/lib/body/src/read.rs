//! The arrays of a body file, by SMPL's keys: their shapes and sizes are checked here, their values
//! in [`BodyModel::from_raw`](crate::BodyModel).

use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use cromosim_arrays::{Array, ArraysError, Container};

use crate::BodyError;
use crate::gender::Gender;
use crate::pose_blocks::{PoseBlock, pose_blocks};
use crate::raw::RawModel;
use crate::reduce::{FileModel, Kind};
use crate::rows::Rows;

/// Vertices of the largest mesh that is read; SMPL-X has 10475.
const VERTEX_LIMIT: usize = 100_000;
/// A closed mesh has two triangles for each vertex, less four.
const TRIANGLE_LIMIT: usize = 2 * VERTEX_LIMIT;
/// Columns of `shapedirs`; SMPL-X has 400, of which 100 are expressions.
const BETA_LIMIT: usize = 400;

/// A body with the 24 joints of SMPL, from any of its kinds of files.
pub(crate) fn read_model<R: Read + Seek>(arrays: &mut Container<R>) -> Result<RawModel, BodyError> {
    let mut file = read_without_posedirs(arrays)?;
    let (vertex_count, joint_count) = (file.raw.template.len() / 3, file.parents.len());
    let features = 9 * (joint_count - 1);
    let posedirs = BodyArrays::new(arrays).floats(
        "posedirs",
        &[Some(vertex_count), Some(3), Some(features)],
        &format!("({vertex_count}, 3, {features}) for {joint_count} joints"),
    )?;
    file.raw.pose_blocks = pose_blocks(&posedirs.values, joint_count).into();
    file.reduced()
}

/// Everything but the pose blocks, which stay empty.
pub(crate) fn read_without_posedirs<R: Read + Seek>(
    arrays: &mut Container<R>,
) -> Result<FileModel, BodyError> {
    let mut arrays = BodyArrays::new(arrays);
    let path = arrays.path.clone();
    let kintree = arrays.integers(
        "kintree_table",
        &[Some(2), None],
        "(2, 24), (2, 52) or (2, 55)",
    )?;
    let joint_count = kintree.shape[1];
    let kind = Kind::from_joint_count(joint_count, &path)?;
    let template = arrays.floats("v_template", &[None, Some(3)], "(V, 3)")?;
    let vertex_count = template.shape[0];
    arrays.check_size(
        "v_template",
        &template.shape,
        0,
        3..=VERTEX_LIMIT,
        "(V, 3) with V",
    )?;
    let (shape_directions, beta_count) = arrays.shape_directions(kind, vertex_count)?;
    let regressor = arrays.floats(
        "J_regressor",
        &[Some(joint_count), Some(vertex_count)],
        &format!("({joint_count}, {vertex_count})"),
    )?;
    let weights = arrays.floats(
        "weights",
        &[Some(vertex_count), Some(joint_count)],
        &format!("({vertex_count}, {joint_count})"),
    )?;
    let faces = arrays.integers("f", &[None, Some(3)], "(F, 3)")?;
    arrays.check_size("f", &faces.shape, 0, 1..=TRIANGLE_LIMIT, "(F, 3) with F")?;
    let gender = arrays.gender()?;
    let raw = RawModel {
        id: id(&path),
        path,
        space: kind.space(),
        gender,
        template: template.values,
        shape_directions,
        beta_count,
        pose_blocks: Rows::new(std::iter::empty::<Vec<PoseBlock>>()).into(),
        regressor: regressor.values,
        weights: weights.values,
        faces: faces.values,
    };
    Ok(FileModel {
        raw,
        parents: kintree.values[..joint_count].to_vec(),
    })
}

/// A container whose arrays are asked for as those of a body.
struct BodyArrays<'a, R> {
    container: &'a mut Container<R>,
    path: PathBuf,
}

impl<'a, R: Read + Seek> BodyArrays<'a, R> {
    fn new(container: &'a mut Container<R>) -> Self {
        let path = container.path().to_owned();
        Self { container, path }
    }

    fn floats(
        &mut self,
        key: &str,
        expected: &[Option<usize>],
        expectation: &str,
    ) -> Result<Array<f64>, BodyError> {
        let entry = self.container.at(key).map_err(without_key)?;
        entry
            .floats(expected, expectation)
            .map_err(BodyError::Arrays)
    }

    fn integers(
        &mut self,
        key: &str,
        expected: &[Option<usize>],
        expectation: &str,
    ) -> Result<Array<i64>, BodyError> {
        let entry = self.container.at(key).map_err(without_key)?;
        entry
            .integers(expected, expectation)
            .map_err(BodyError::Arrays)
    }

    /// The columns of shapedirs that are shapes, (V, 3, B), and B.
    fn shape_directions(
        &mut self,
        kind: Kind,
        vertex_count: usize,
    ) -> Result<(Vec<f64>, usize), BodyError> {
        let shapedirs = self.floats(
            "shapedirs",
            &[Some(vertex_count), Some(3), None],
            &format!("({vertex_count}, 3, B)"),
        )?;
        let columns = shapedirs.shape[2];
        let expectation = format!("({vertex_count}, 3, B) with B");
        self.check_size(
            "shapedirs",
            &shapedirs.shape,
            2,
            1..=BETA_LIMIT,
            &expectation,
        )?;
        let beta_count = kind.beta_count(columns);
        let rows = shapedirs.values.chunks_exact(columns);
        let directions = rows.flat_map(|row| &row[..beta_count]).copied().collect();
        Ok((directions, beta_count))
    }

    /// The gender that the file states, else the one in its name.
    fn gender(&mut self) -> Result<Option<Gender>, BodyError> {
        let entry = self.container.get("gender").map_err(BodyError::Arrays)?;
        let stated = entry.and_then(|entry| Gender::from_name(&entry.text().ok()?));
        Ok(stated.or_else(|| gender_in_name(&self.path)))
    }

    /// Whether a dimension lies within limits.
    fn check_size(
        &self,
        key: &str,
        shape: &[usize],
        axis: usize,
        allowed: std::ops::RangeInclusive<usize>,
        expectation: &str,
    ) -> Result<(), BodyError> {
        if allowed.contains(&shape[axis]) {
            return Ok(());
        }
        Err(BodyError::Arrays(ArraysError::Shape {
            path: self.path.clone(),
            key: key.to_owned(),
            found: shape.iter().map(|&size| size as u64).collect(),
            expected: format!(
                "{expectation} from {} to {}",
                allowed.start(),
                allowed.end()
            ),
        }))
    }
}

/// A key that a container lacks, in terms of bodies.
fn without_key(error: ArraysError) -> BodyError {
    match error {
        ArraysError::MissingKey { path, key, .. } => BodyError::MissingKey { path, key },
        other => BodyError::Arrays(other),
    }
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

/// The gender in names such as `SMPL_FEMALE`, `basicmodel_m_lbs_10_207_0_v1.0.0` and
/// `smplh/male/model`.
fn gender_in_name(path: &Path) -> Option<Gender> {
    let in_name = |name: String| name.split(['_', '-', '.']).find_map(Gender::from_name);
    stem(Some(path))
        .and_then(in_name)
        .or_else(|| stem(path.parent()).and_then(in_name))
}
