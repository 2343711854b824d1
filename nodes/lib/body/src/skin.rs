//! The whole mesh in f32, fast enough to watch it live.
//!
//! Vertices are brought into tiles of [`LANES`] vertices that hang on the same joints, and every operation
//! runs over the lanes of a tile, so that the compiler makes vector instructions of it. posedirs
//! are a sparse matrix: per tile and axis, the rows that are not zero. A batch walks the tiles once
//! for several poses, so that the coefficients come from memory once for all of them. No
//! multiplication is fused with its addition, so that every processor gives the same bytes.

use nalgebra::Vector3;
use pulp::NullaryFnOnce;

use crate::skin_tables::{FEATURES, LANES, Lanes, RestTiles, SkinTables};
use crate::{BodyPose, JOINT_COUNT, ShapedBody};

/// Poses per walk over the tiles: what keeps their matrices (2 KB each) in the first-level cache
/// beside a tile.
const POSES_PER_WALK: usize = 8;
/// Poses that share each load of a coefficient.
const POSES_PER_LOAD: usize = 4;

/// What one pose does to every tile.
struct PoseMatrices {
    /// R - I of joints 1 to 23, row-major.
    features: [f32; FEATURES],
    /// [rotation | translation] from the rest mesh to the world less the root, (3, 4).
    root_from_rest: [[[f32; 4]; 3]; JOINT_COUNT],
    root: [f32; 3],
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
        let tables = self.model().skin_tables();
        vertices.resize(poses.len() * tables.vertex_count, [0.0; 3]);
        for (poses, vertices) in poses
            .chunks(POSES_PER_WALK)
            .zip(vertices.chunks_mut(POSES_PER_WALK * tables.vertex_count))
        {
            let matrices: Vec<PoseMatrices> =
                poses.iter().map(|pose| self.pose_matrices(pose)).collect();
            pulp::Arch::new().dispatch(Walk {
                tables,
                rest_tiles: self.rest_tiles(),
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
