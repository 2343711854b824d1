//! Points of the skin that sensors sit on.

use nalgebra::Vector3;

use crate::Joint;

/// A point of the skin: it follows its triangle through every shape and pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Index into [`crate::BodyModel::faces`].
    pub triangle: u32,
    /// Weights of the triangle's corners: in [0, 1], sum 1.
    pub barycentrics: [f64; 3],
    /// The joint that moves the point most: the largest skin weight, interpolated over the
    /// triangle.
    pub joint: Joint,
}

/// A site under the name that placements call it by, such as `left_watch`.
#[derive(Clone, Debug)]
pub(crate) struct NamedSite {
    pub name: String,
    pub site: Site,
}

/// The point at `barycentrics` of a triangle, in the frame and unit of `vertices`.
pub(crate) fn point_at(
    corners: &[u32; 3],
    barycentrics: &[f64; 3],
    vertices: &[Vector3<f64>],
) -> Vector3<f64> {
    corners
        .iter()
        .zip(barycentrics)
        .map(|(&vertex, weight)| vertices[vertex as usize] * *weight)
        .sum()
}
