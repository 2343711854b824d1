//! The embedded body's pose corrections in closed form; the twin of `scripts/posedirs.py`.
//!
//! posedirs P (V, 3, 23, 9) is the sum of three terms; R_j is a joint's rotation, W_j the skin
//! weight of a joint and its descendants, n the vertex normal, S = diag(-1, 1, 1) the mirror:
//! 1. what linear blend skinning loses to second order: -c_j W_j (1 - W_j) sym(R_j - I) (v - J_j);
//! 2. bulges along the normal: amplitude * mask(v) * (R_j - I)[row, column] * n;
//! 3. shoulder and hip: sum_k phi_k(v) C_k (R_j - I) with phi_k = exp(-|v - c_k|^2 / 2 sigma^2),
//!    the right side mirrored.

use nalgebra::{SMatrix, Vector3};
use serde::Deserialize;

use crate::pose_blocks::{PoseBlock, vertex_pose_blocks};
use crate::{JOINT_COUNT, Joint};

/// One vertex' directions (3, 207), row-major.
type Directions = SMatrix<f64, 207, 3>;

/// Entries below this many metres are zero: it keeps the corrections sparse.
const SMALLEST: f64 = 2e-6;
/// Beyond so many sigma a Gaussian of these coefficients is far below [`SMALLEST`].
const REACH_IN_SIGMA: f64 = 7.5;

/// The constants of the three terms, as `assets/posedirs.json` holds them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Constants {
    /// c_j of term 1.
    lbs: [f64; JOINT_COUNT],
    bulges: Vec<Bulge>,
    rbf: Vec<Gaussians>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Bulge {
    #[serde(rename = "name")]
    _name: String,
    joint: usize,
    row: usize,
    col: usize,
    sgn: f64,
    /// The joints whose weights mask the bulge.
    wj: Vec<usize>,
    /// The axis along which it fades, its centre and width, m.
    axis: usize,
    c: f64,
    s: f64,
    /// The side of the body: 1 the front, -1 the back.
    nz: f64,
    /// m.
    amp: f64,
    #[serde(rename = "xramp")]
    _xramp: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Gaussians {
    joint: usize,
    /// m.
    sigma: f64,
    centers: Vec<[f64; 3]>,
    /// `[centre][9 elements of R - I][axis]`, m.
    coef: Vec<[[f64; 3]; 9]>,
}

/// The three terms on one body.
#[derive(Debug)]
pub(crate) struct ClosedForm {
    constants: Constants,
    vertices: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
    joints: Vec<Vector3<f64>>,
}

impl ClosedForm {
    /// On a body of vertices (V, 3), triangles (F, 3) and joints (24, 3), m.
    pub fn new(constants: Constants, template: &[f64], faces: &[i64], joints: &[f64]) -> Self {
        let points = |values: &[f64]| -> Vec<Vector3<f64>> {
            let points = values.as_chunks::<3>().0.iter();
            points.map(|&point| Vector3::from(point)).collect()
        };
        let vertices = points(template);
        Self {
            normals: vertex_normals(&vertices, faces),
            joints: points(joints),
            vertices,
            constants,
        }
    }

    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// The blocks of a vertex with these skin weights.
    pub fn of_vertex(&self, vertex: usize, skin_weights: &[(u8, f64)]) -> Vec<PoseBlock> {
        let mut weights = [0.0; JOINT_COUNT];
        for &(joint, weight) in skin_weights {
            weights[joint as usize] = weight;
        }
        let (normal, constants) = (&self.normals[vertex], &self.constants);
        let vertex = &self.vertices[vertex];
        let mut directions = Directions::zeros();
        add_blending_loss(
            &mut directions,
            &constants.lbs,
            vertex,
            &weights,
            &self.joints,
        );
        for bulge in &constants.bulges {
            add_bulge(&mut directions, bulge, vertex, normal, &weights);
        }
        for gaussians in &constants.rbf {
            add_gaussians(&mut directions, gaussians, vertex);
        }
        vertex_pose_blocks(
            directions
                .map(|entry| if entry.abs() < SMALLEST { 0.0 } else { entry })
                .as_slice(),
            JOINT_COUNT,
        )
    }
}

/// Unit normals, area-weighted over the triangles around.
fn vertex_normals(vertices: &[Vector3<f64>], faces: &[i64]) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); vertices.len()];
    for corners in faces.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(|vertex| vertices[vertex as usize]);
        let area_vector = (b - a).cross(&(c - a));
        for &vertex in corners {
            normals[vertex as usize] += area_vector;
        }
    }
    normals
        .into_iter()
        .map(|normal| normal / normal.norm().max(1e-12))
        .collect()
}

/// The row of element (row, column) of R_j - I.
fn feature(joint: usize, row: usize, column: usize) -> usize {
    9 * (joint - 1) + 3 * row + column
}

fn add_blending_loss(
    directions: &mut Directions,
    strengths: &[f64; JOINT_COUNT],
    vertex: &Vector3<f64>,
    weights: &[f64; JOINT_COUNT],
    joints: &[Vector3<f64>],
) {
    let mut with_descendants = *weights;
    for joint in Joint::ALL.into_iter().rev() {
        if let Some(parent) = joint.parent() {
            with_descendants[parent.index()] += with_descendants[joint.index()];
        }
    }
    for joint in 1..JOINT_COUNT {
        let weight = with_descendants[joint];
        let half_loss = 0.5 * strengths[joint] * weight * (1.0 - weight);
        let lever_arm = vertex - joints[joint];
        for axis in 0..3 {
            for other in 0..3 {
                directions[(feature(joint, axis, other), axis)] -= half_loss * lever_arm[other];
                directions[(feature(joint, other, axis), axis)] -= half_loss * lever_arm[other];
            }
        }
    }
}

fn mirrored(joint: usize) -> usize {
    Joint::ALL[joint].mirrored().index()
}

/// The sign that mirroring gives to an element of a rotation matrix.
fn mirror_sign(row: usize, column: usize) -> f64 {
    if (row == 0) != (column == 0) {
        -1.0
    } else {
        1.0
    }
}

fn add_bulge(
    directions: &mut Directions,
    bulge: &Bulge,
    vertex: &Vector3<f64>,
    normal: &Vector3<f64>,
    weights: &[f64; JOINT_COUNT],
) {
    let mut add = |joint: usize, along: f64, weight: f64, sign: f64| {
        let fade = (-0.5 * ((along - bulge.c) / bulge.s).powi(2)).exp();
        let amount =
            sign * bulge.amp * bulge.sgn * weight * fade * (bulge.nz * normal.z).clamp(0.0, 1.0);
        for axis in 0..3 {
            directions[(feature(joint, bulge.row, bulge.col), axis)] += amount * normal[axis];
        }
    };
    let along = vertex[bulge.axis];
    add(
        bulge.joint,
        along,
        bulge.wj.iter().map(|&joint| weights[joint]).sum(),
        1.0,
    );
    if mirrored(bulge.joint) != bulge.joint {
        let along = if bulge.axis == 0 { -along } else { along };
        let weight = bulge.wj.iter().map(|&joint| weights[mirrored(joint)]).sum();
        add(
            mirrored(bulge.joint),
            along,
            weight,
            mirror_sign(bulge.row, bulge.col),
        );
    }
}

fn add_gaussians(directions: &mut Directions, gaussians: &Gaussians, vertex: &Vector3<f64>) {
    let doubled_variance = 2.0 * gaussians.sigma * gaussians.sigma;
    let reach_squared = (REACH_IN_SIGMA * gaussians.sigma).powi(2);
    for (joint, mirrors) in [(gaussians.joint, false), (mirrored(gaussians.joint), true)] {
        let seen = if mirrors {
            Vector3::new(-vertex.x, vertex.y, vertex.z)
        } else {
            *vertex
        };
        for (center, coefficients) in gaussians.centers.iter().zip(&gaussians.coef) {
            let distance_squared = (seen - Vector3::from(*center)).norm_squared();
            if distance_squared > reach_squared {
                continue;
            }
            let phi = (-distance_squared / doubled_variance).exp();
            for (element, values) in coefficients.iter().enumerate() {
                for (axis, value) in values.iter().enumerate() {
                    let sign = if mirrors {
                        mirror_sign(element / 3, element % 3) * if axis == 0 { -1.0 } else { 1.0 }
                    } else {
                        1.0
                    };
                    directions[(9 * (joint - 1) + element, axis)] += sign * phi * value;
                }
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::{Path, PathBuf};

    use cromosim_arrays::NpzReader;

    use crate::BodyModel;

    /// The largest difference between the embedded body's posedirs and those of `ids` in `expected`
    /// (K, 3, 207).
    fn largest_difference(ids: impl Iterator<Item = usize>, expected: &[f64]) -> f64 {
        let body = BodyModel::embedded();
        let mut largest: f64 = 0.0;
        for (vertex, expected) in ids.zip(expected.chunks_exact(621)) {
            let mut dense = [0.0; 621];
            for block in body.pose_blocks().row(vertex) {
                for (i, &coefficient) in block.coefficients.iter().enumerate() {
                    dense[(i / 9) * 207 + 9 * (block.joint as usize - 1) + i % 9] =
                        f64::from(coefficient);
                }
            }
            largest = dense
                .iter()
                .zip(expected)
                .map(|(a, b)| (a - b).abs())
                .fold(largest, f64::max);
        }
        largest
    }

    // The script made them from float64 arrays, this crate makes them from float32.
    const TOLERANCE: f64 = 1e-7;

    #[test]
    fn generated_posedirs_are_those_of_the_script() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/posedirs_sample.npz");
        let mut npz = NpzReader::open(&path).unwrap();
        let ids = npz
            .integers("vertex_ids", &[None], "")
            .unwrap()
            .unwrap()
            .values;
        let expected = npz
            .floats("posedirs", &[None, Some(3), Some(207)], "")
            .unwrap()
            .unwrap()
            .values;
        assert!(ids.len() > 150 && expected.iter().filter(|entry| **entry != 0.0).count() > 5000);
        let difference = largest_difference(ids.iter().map(|&id| id as usize), &expected);
        assert!(difference < TOLERANCE, "{difference} m");
    }

    #[test]
    fn generated_posedirs_are_those_of_the_whole_body() {
        let data = std::env::var_os("CROMOSIM_DATA").map(PathBuf::from);
        let data = data.unwrap_or_else(|| {
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../../shared/data")
        });
        let path = data.join("../body/body.npz");
        if !path.exists() {
            assert!(
                std::env::var_os("CROMOSIM_REQUIRE_ALL").is_none_or(|all| all != "1"),
                "body.npz is missing"
            );
            println!("skipped: no body.npz beside the data folder");
            return;
        }
        let expected = NpzReader::open(&path)
            .unwrap()
            .floats("posedirs", &[None, Some(3), Some(207)], "")
            .unwrap()
            .unwrap();
        let difference = largest_difference(0..expected.shape[0], &expected.values);
        println!("posedirs: {difference:.2e} m");
        assert!(difference < TOLERANCE, "{difference} m");
    }
}
