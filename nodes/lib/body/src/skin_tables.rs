//! A body in the order in which the skin kernel walks over it: tiles of [`LANES`] vertices that hang
//! on the same joints.

use nalgebra::Vector3;

use crate::JOINT_COUNT;
use crate::pose_blocks::PoseBlock;
use crate::rows::Rows;

/// Vertices per tile: eight f32 fill an AVX register.
pub(crate) const LANES: usize = 8;
/// Elements of R - I of joints 1 to 23 (9 each, 207), filled up to what a `u8` counts: no index needs
/// a check.
pub(crate) const FEATURES: usize = 256;
/// Marks lanes that fill up the last tile.
const NO_VERTEX: u32 = u32::MAX;

/// One number of each vertex of a tile.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub(crate) struct Lanes(pub [f32; LANES]);

impl Lanes {
    pub const ZERO: Self = Self([0.0; LANES]);

    /// Adds `values * factor`, lane by lane, without fusing the two operations.
    #[inline(always)]
    pub fn add_scaled(&mut self, values: &Self, factor: f32) {
        for (sum, value) in self.0.iter_mut().zip(&values.0) {
            *sum += value * factor;
        }
    }
}

/// posedirs and weights in the order of the kernel.
#[derive(Debug)]
pub(crate) struct SkinTables {
    pub vertex_count: usize,
    /// Which vertex each lane is.
    pub order: Vec<[u32; LANES]>,
    /// Per tile and axis, what the features that move it add.
    pub pose_rows: Rows<Lanes>,
    /// Which features these are: 9 (joint - 1) + 3 row + column.
    pub pose_features: Rows<u8>,
    /// Per tile, the joints that move it and how much.
    pub weights: Rows<(u8, Lanes)>,
}

/// Rest vertices in the order of the kernel: x, y, z of each tile.
#[derive(Debug, Clone)]
pub(crate) struct RestTiles(pub Vec<[Lanes; 3]>);

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

    /// Rest vertices (V, 3), m, as tiles.
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
