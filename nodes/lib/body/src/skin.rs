//! The whole mesh in f32, fast enough to watch it live.
//!
//! Vertices are brought into tiles of [`LANES`] that hang on the same joints, and every operation
//! runs over the lanes of a tile, so that the compiler makes vector instructions of it. posedirs
//! are a sparse matrix: per tile and axis, the rows that are not zero. A batch walks the tiles once
//! for several poses, so that the coefficients come from memory once for all of them. No
//! multiplication is fused with its addition, so that every processor gives the same bytes.

use nalgebra::Vector3;
use pulp::NullaryFnOnce;

use crate::model::{PoseBlock, Rows};
use crate::{BodyPose, JOINT_COUNT, ShapedBody};

/// Vertices per tile: eight f32 fill an AVX register.
const LANES: usize = 8;
/// Elements of R - I, with joint 0 and up to what a `u8` may count: no index needs a check.
const FEATURES: usize = 256;
/// Poses per walk over the tiles: what keeps their matrices (2 KB each) in the first-level cache
/// beside a tile.
const POSES_PER_WALK: usize = 8;
/// Poses that share each load of a coefficient.
const POSES_PER_LOAD: usize = 4;
/// Marks lanes that fill up the last tile.
const NO_VERTEX: u32 = u32::MAX;

/// One number of each vertex of a tile.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
struct Lanes([f32; LANES]);

impl Lanes {
    const ZERO: Self = Self([0.0; LANES]);

    #[inline(always)]
    fn add_scaled(&mut self, values: &Self, factor: f32) {
        for (sum, value) in self.0.iter_mut().zip(&values.0) {
            *sum += value * factor;
        }
    }
}

/// posedirs and weights in the order of the kernel.
#[derive(Debug)]
pub(crate) struct SkinTables {
    vertex_count: usize,
    /// Which vertex each lane is.
    order: Vec<[u32; LANES]>,
    /// Per tile and axis, what the features that move it add.
    pose_rows: Rows<Lanes>,
    /// Which features these are: 9 (joint - 1) + 3 row + column.
    pose_features: Rows<u8>,
    /// Per tile, the joints that move it and how much.
    weights: Rows<(u8, Lanes)>,
}

/// Rest vertices in the order of the kernel: x, y, z of each tile.
#[derive(Debug, Clone)]
pub(crate) struct RestTiles(Vec<[Lanes; 3]>);

/// What one pose does to every tile.
struct PoseMatrices {
    /// R - I of joints 1 to 23, row-major.
    features: [f32; FEATURES],
    /// [rotation | translation] from the rest mesh to the world less the root, (3, 4).
    root_from_rest: [[[f32; 4]; 3]; JOINT_COUNT],
    root: [f32; 3],
}

impl SkinTables {
    pub fn new(
        pose_blocks: &Rows<PoseBlock>,
        skin_weights: &Rows<(u8, f64)>,
        vertex_count: usize,
    ) -> Self {
        let mut sorted: Vec<u32> = (0..vertex_count as u32).collect();
        sorted.sort_by_cached_key(|&vertex| {
            let corrected_by: u32 = pose_blocks
                .row(vertex as usize)
                .iter()
                .map(|block| 1 << block.joint)
                .sum();
            let moved_by: u32 = skin_weights
                .row(vertex as usize)
                .iter()
                .map(|&(joint, _)| 1 << joint)
                .sum();
            (corrected_by, moved_by)
        });
        let tile = |vertices: &[u32]| {
            std::array::from_fn(|lane| vertices.get(lane).copied().unwrap_or(NO_VERTEX))
        };
        let order: Vec<[u32; LANES]> = sorted.chunks(LANES).map(tile).collect();
        let rows: Vec<_> = order
            .iter()
            .flat_map(|vertices| pose_rows(vertices, pose_blocks))
            .collect();
        Self {
            vertex_count,
            pose_rows: Rows::new(
                rows.iter()
                    .map(|of_axis| of_axis.iter().map(|(_, lanes)| *lanes)),
            ),
            pose_features: Rows::new(
                rows.iter()
                    .map(|of_axis| of_axis.iter().map(|(feature, _)| *feature)),
            ),
            weights: Rows::new(order.iter().map(|vertices| weights(vertices, skin_weights))),
            order,
        }
    }

    pub fn tiled(&self, rest_vertices: &[Vector3<f64>]) -> RestTiles {
        let value = |axis: usize, vertex: u32| {
            if vertex == NO_VERTEX {
                0.0
            } else {
                rest_vertices[vertex as usize][axis] as f32
            }
        };
        RestTiles(
            self.order
                .iter()
                .map(|vertices| {
                    std::array::from_fn(|axis| Lanes(vertices.map(|vertex| value(axis, vertex))))
                })
                .collect(),
        )
    }
}

/// Per axis, the features with a coefficient that is not zero on any lane.
fn pose_rows(vertices: &[u32; LANES], pose_blocks: &Rows<PoseBlock>) -> [Vec<(u8, Lanes)>; 3] {
    let mut dense = vec![[Lanes::ZERO; 3]; FEATURES];
    for (lane, &vertex) in vertices
        .iter()
        .enumerate()
        .filter(|(_, vertex)| **vertex != NO_VERTEX)
    {
        for block in pose_blocks.row(vertex as usize) {
            for (i, &coefficient) in block.coefficients.iter().enumerate() {
                dense[9 * (block.joint as usize - 1) + i % 9][i / 9].0[lane] = coefficient;
            }
        }
    }
    std::array::from_fn(|axis| {
        let rows = dense
            .iter()
            .map(|axes| axes[axis])
            .enumerate()
            .filter(|(_, lanes)| *lanes != Lanes::ZERO);
        rows.map(|(feature, lanes)| (feature as u8, lanes))
            .collect()
    })
}

fn weights(vertices: &[u32; LANES], skin_weights: &Rows<(u8, f64)>) -> Vec<(u8, Lanes)> {
    let mut dense = [Lanes::ZERO; JOINT_COUNT];
    for (lane, &vertex) in vertices
        .iter()
        .enumerate()
        .filter(|(_, vertex)| **vertex != NO_VERTEX)
    {
        skin_weights
            .row(vertex as usize)
            .iter()
            .for_each(|&(joint, weight)| dense[joint as usize].0[lane] = weight as f32);
    }
    dense
        .into_iter()
        .enumerate()
        .filter(|(_, lanes)| *lanes != Lanes::ZERO)
        .map(|(joint, lanes)| (joint as u8, lanes))
        .collect()
}

impl ShapedBody {
    /// The whole mesh in the world, (V, 3), m: SMPL's skinning (Loper et al. 2015, eq. 2 and 9) in
    /// f32, within 2 micrometres of f64 near the origin; far from it f32 itself is coarser (4
    /// micrometres at 50 m). `vertices` is filled anew.
    pub fn skin(&self, pose: &BodyPose, vertices: &mut Vec<[f32; 3]>) {
        self.skin_batch(std::slice::from_ref(pose), vertices);
    }

    /// The mesh of several poses one after the other, (N, V, 3), m; each the same as from
    /// [`Self::skin`].
    pub fn skin_batch(&self, poses: &[BodyPose], vertices: &mut Vec<[f32; 3]>) {
        let tables = &self.model().skin_tables;
        vertices.resize(poses.len() * tables.vertex_count, [0.0; 3]);
        for (poses, vertices) in poses
            .chunks(POSES_PER_WALK)
            .zip(vertices.chunks_mut(POSES_PER_WALK * tables.vertex_count))
        {
            let matrices: Vec<PoseMatrices> =
                poses.iter().map(|pose| self.pose_matrices(pose)).collect();
            pulp::Arch::new().dispatch(Walk {
                tables,
                rest_tiles: &self.rest_tiles,
                poses: &matrices,
                vertices,
            });
        }
    }

    fn pose_matrices(&self, pose: &BodyPose) -> PoseMatrices {
        // Near the origin f32 is finest, so that the root is added last.
        let about_root = BodyPose {
            root_position: Vector3::zeros(),
            local_rotations: pose.local_rotations,
        };
        let root_from_segments = self.world_from_segments(&about_root);
        let mut features = [0.0; FEATURES];
        for (features, rotation) in features
            .as_chunks_mut::<9>()
            .0
            .iter_mut()
            .zip(&pose.local_rotations[1..])
        {
            let matrix = rotation.to_rotation_matrix();
            *features = std::array::from_fn(|i| {
                (matrix[(i / 3, i % 3)] - if i / 3 == i % 3 { 1.0 } else { 0.0 }) as f32
            });
        }
        let root_from_rest = std::array::from_fn(|joint| {
            let rotation = root_from_segments[joint].rotation.to_rotation_matrix();
            let translation = root_from_segments[joint].translation.vector
                - rotation * self.joints_in_model()[joint];
            let entry = |row, column| {
                if column == 3 {
                    translation[row]
                } else {
                    rotation[(row, column)]
                }
            };
            std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column) as f32))
        });
        PoseMatrices {
            features,
            root_from_rest,
            root: pose
                .root_position
                .map(|coordinate| coordinate as f32)
                .into(),
        }
    }
}

/// [`skin_walk`], to be compiled for each kind of processor.
struct Walk<'a> {
    tables: &'a SkinTables,
    rest_tiles: &'a RestTiles,
    poses: &'a [PoseMatrices],
    vertices: &'a mut [[f32; 3]],
}

impl NullaryFnOnce for Walk<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        skin_walk(self.tables, self.rest_tiles, self.poses, self.vertices);
    }
}

#[inline(always)]
fn skin_walk(
    tables: &SkinTables,
    rest_tiles: &RestTiles,
    poses: &[PoseMatrices],
    vertices: &mut [[f32; 3]],
) {
    for (tile, (lane_vertices, rest)) in tables.order.iter().zip(&rest_tiles.0).enumerate() {
        for (poses, vertices) in poses
            .chunks(POSES_PER_LOAD)
            .zip(vertices.chunks_mut(POSES_PER_LOAD * tables.vertex_count))
        {
            match <&[PoseMatrices; POSES_PER_LOAD]>::try_from(poses) {
                Ok(poses) => skin_tile(
                    tables,
                    tile,
                    rest,
                    poses.each_ref(),
                    lane_vertices,
                    vertices,
                ),
                Err(_) => {
                    for (pose, vertices) in
                        poses.iter().zip(vertices.chunks_mut(tables.vertex_count))
                    {
                        skin_tile(tables, tile, rest, [pose], lane_vertices, vertices);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn skin_tile<const N: usize>(
    tables: &SkinTables,
    tile: usize,
    rest: &[Lanes; 3],
    poses: [&PoseMatrices; N],
    lane_vertices: &[u32; LANES],
    vertices: &mut [[f32; 3]],
) {
    // Plain calls rather than array::from_fn: a closure that is not inlined falls back to the
    // smallest registers.
    let x = corrected(tables, 3 * tile, &rest[0], &poses);
    let y = corrected(tables, 3 * tile + 1, &rest[1], &poses);
    let z = corrected(tables, 3 * tile + 2, &rest[2], &poses);
    for (n, pose) in poses.iter().enumerate() {
        let (weights, point) = (tables.weights.row(tile), [&x[n], &y[n], &z[n]]);
        let moved = [
            moved(weights, pose, 0, point),
            moved(weights, pose, 1, point),
            moved(weights, pose, 2, point),
        ];
        scatter(
            &moved,
            lane_vertices,
            &mut vertices[n * tables.vertex_count..][..tables.vertex_count],
        );
    }
}

/// A tile to its vertices' places. Not inlined: seeing single lanes taken out, the compiler would
/// give up whole registers before.
#[inline(never)]
fn scatter(moved: &[Lanes; 3], lane_vertices: &[u32; LANES], vertices: &mut [[f32; 3]]) {
    for (lane, &vertex) in lane_vertices.iter().enumerate() {
        if let Some(out) = vertices.get_mut(vertex as usize) {
            *out = [moved[0].0[lane], moved[1].0[lane], moved[2].0[lane]];
        }
    }
}

/// One axis of rest + P vec(R - I) for several poses. Two sums, of even and odd rows, keep the
/// adders busy.
#[inline(always)]
fn corrected<const N: usize>(
    tables: &SkinTables,
    row: usize,
    rest: &Lanes,
    poses: &[&PoseMatrices; N],
) -> [Lanes; N] {
    let (rows, odd_row) = tables.pose_rows.row(row).as_chunks::<2>();
    let (features, odd_feature) = tables.pose_features.row(row).as_chunks::<2>();
    let (mut even, mut odd) = ([*rest; N], [Lanes::ZERO; N]);
    for (rows, features) in rows.iter().zip(features) {
        for n in 0..N {
            even[n].add_scaled(&rows[0], poses[n].features[features[0] as usize]);
            odd[n].add_scaled(&rows[1], poses[n].features[features[1] as usize]);
        }
    }
    for (row, feature) in odd_row.iter().zip(odd_feature) {
        for n in 0..N {
            even[n].add_scaled(row, poses[n].features[*feature as usize]);
        }
    }
    for n in 0..N {
        even[n].add_scaled(&odd[n], 1.0);
    }
    even
}

/// One axis of sum_j w_j [rotation | translation]_j times (x, y, z, 1), and the root. Four named
/// sums stay in registers, an array would not.
#[inline(always)]
fn moved(
    weights: &[(u8, Lanes)],
    pose: &PoseMatrices,
    axis: usize,
    [x, y, z]: [&Lanes; 3],
) -> Lanes {
    let (mut a, mut b, mut c, mut d) = (Lanes::ZERO, Lanes::ZERO, Lanes::ZERO, Lanes::ZERO);
    for (joint, weights) in weights {
        let row = &pose.root_from_rest[*joint as usize][axis];
        a.add_scaled(weights, row[0]);
        b.add_scaled(weights, row[1]);
        c.add_scaled(weights, row[2]);
        d.add_scaled(weights, row[3]);
    }
    for lane in 0..LANES {
        d.0[lane] += a.0[lane] * x.0[lane] + b.0[lane] * y.0[lane] + c.0[lane] * z.0[lane];
        d.0[lane] += pose.root[axis];
    }
    d
}
