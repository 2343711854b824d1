//! Bodies to files: SMPL npz and Wavefront OBJ.

use std::io::{self, Cursor, Write};
use std::path::Path;

use cromosim_arrays::NpzWriter;

use crate::{BodyError, BodyModel, JOINT_COUNT, Joint};

impl BodyModel {
    /// Writes [`Self::to_npz`].
    ///
    /// # Errors
    /// [`BodyError::Write`].
    pub fn write_npz(&self, path: &Path) -> Result<(), BodyError> {
        let written = self.to_npz().and_then(|bytes| std::fs::write(path, bytes));
        written.map_err(|source| BodyError::Write {
            path: path.to_owned(),
            source,
        })
    }

    /// The model's file with SMPL's keys, so that other SMPL software reads it: v_template,
    /// shapedirs, posedirs, J_regressor, weights, kintree_table, f, J, bs_style, bs_type, and
    /// gender where known. Arrays are float32 where that is exact, else float64; posedirs are
    /// float32. The same model gives the same bytes.
    ///
    /// # Errors
    /// What the archive says.
    pub fn to_npz(&self) -> io::Result<Vec<u8>> {
        let count = self.vertex_count();
        // In memory: an archive that breaks off in a file says so on standard error as well.
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.floats("v_template", &[count, 3], &flat(&self.template))?;
        npz.floats(
            "shapedirs",
            &[count, 3, self.beta_count],
            &self.shape_directions,
        )?;
        npz.floats(
            "posedirs",
            &[count, 3, 9 * (JOINT_COUNT - 1)],
            &self.dense_posedirs(),
        )?;
        let (mut regressor, mut weights) = (
            vec![0.0; JOINT_COUNT * count],
            vec![0.0; JOINT_COUNT * count],
        );
        for (joint, row) in self.regressor.rows().enumerate() {
            row.iter()
                .for_each(|&(vertex, weight)| regressor[joint * count + vertex as usize] = weight);
        }
        for (vertex, row) in self.skin_weights.rows().enumerate() {
            row.iter().for_each(|&(joint, weight)| {
                weights[vertex * JOINT_COUNT + joint as usize] = weight
            });
        }
        npz.floats("J_regressor", &[JOINT_COUNT, count], &regressor)?;
        npz.floats("weights", &[count, JOINT_COUNT], &weights)?;
        let parents = Joint::ALL.map(|joint| {
            joint
                .parent()
                .map_or(u32::MAX, |parent| parent.index() as u32)
        });
        let joints = Joint::ALL.map(|joint| joint.index() as u32);
        npz.integers(
            "kintree_table",
            &[2, JOINT_COUNT],
            &[parents, joints].concat(),
        )?;
        npz.integers("f", &[self.faces.len(), 3], self.faces.as_flattened())?;
        npz.floats(
            "J",
            &[JOINT_COUNT, 3],
            &flat(&self.joint_shape_directions().0),
        )?;
        npz.text("bs_style", "lbs")?;
        npz.text("bs_type", "lrotmin")?;
        if let Some(gender) = self.gender {
            npz.text("gender", gender.name())?;
        }
        Ok(npz.finish()?.into_inner())
    }

    /// posedirs (V, 3, 207) with their zeros.
    fn dense_posedirs(&self) -> Vec<f64> {
        let features = 9 * (JOINT_COUNT - 1);
        let mut dense = vec![0.0; self.vertex_count() * 3 * features];
        for (vertex, blocks) in self.pose_blocks().rows().enumerate() {
            for block in blocks {
                for (i, &coefficient) in block.coefficients.iter().enumerate() {
                    dense[(3 * vertex + i / 9) * features
                        + 9 * (block.joint as usize - 1)
                        + i % 9] = f64::from(coefficient);
                }
            }
        }
        dense
    }
}

fn flat(points: &[nalgebra::Vector3<f64>]) -> Vec<f64> {
    points
        .iter()
        .flat_map(|point| [point.x, point.y, point.z])
        .collect()
}

/// Writes a mesh as Wavefront OBJ: one `v x y z` (m, micrometres kept) a vertex, one `f a b c`
/// (1-based) a triangle.
///
/// # Errors
/// What `writer` says.
pub fn write_obj(
    writer: &mut impl Write,
    vertices: &[[f32; 3]],
    faces: &[[u32; 3]],
) -> io::Result<()> {
    for [x, y, z] in vertices {
        writeln!(writer, "v {x:.6} {y:.6} {z:.6}")?;
    }
    for corners in faces {
        let [a, b, c] = corners.map(|vertex| u64::from(vertex) + 1);
        writeln!(writer, "f {a} {b} {c}")?;
    }
    writer.flush()
}
