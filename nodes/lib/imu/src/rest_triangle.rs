//! A triangle of the skin, at rest and moved.

use cromosim_body::lanes::{
    RotationLanes, VectorLanes, cross, difference, divided, dot, gathered, norm, number,
    rotation_of_columns, scaled, sum,
};
use nalgebra::{Matrix2, Matrix3, Rotation3, UnitQuaternion, Vector3};
use pulp::Simd;

/// What an edge, and the height over an edge, must exceed, m: far below any mesh's, far above what
/// rounding leaves of a triangle without area.
const SMALLEST_EDGE: f64 = 1e-9;

/// A triangle's shape at rest, in its own plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestTriangle {
    /// Inverse of the matrix whose columns are the two edges from the first corner.
    edges_inverse: Matrix2<f64>,
}

impl RestTriangle {
    /// The shape, and model_from_triangle; `None` for a triangle without area.
    pub(crate) fn new(corners: &[Vector3<f64>; 3]) -> Option<(Self, UnitQuaternion<f64>)> {
        let [x, y, z] = edge_axes(corners)?;
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
        let edges_inverse = edges_in_plane(corners, &x, &y).try_inverse()?;
        Some((
            Self { edges_inverse },
            UnitQuaternion::from_rotation_matrix(&rotation),
        ))
    }

    /// world_from_triangle of moved corners: z is their normal; about it, the rotation part (polar
    /// decomposition) of what turned the rest triangle into the moved one, so that a stretched
    /// triangle turns as a whole and not as its first edge does.
    pub(crate) fn frame(&self, corners: &[Vector3<f64>; 3]) -> Option<UnitQuaternion<f64>> {
        let [edge, across, normal] = edge_axes(corners)?;
        let gradient = edges_in_plane(corners, &edge, &across) * self.edges_inverse;
        let (sine, cosine) = (gradient.m21 - gradient.m12, gradient.m11 + gradient.m22);
        let x = (edge * cosine + across * sine) / sine.hypot(cosine);
        let rotation =
            Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, normal.cross(&x), normal]));
        Some(UnitQuaternion::from_rotation_matrix(&rotation))
    }

    /// [`Self::frame`] of each lane, operation by operation; `otherwise` in the lanes that have none.
    #[inline(always)]
    pub(crate) fn frames<S: Simd>(
        &self,
        s: S,
        corners: &[VectorLanes<S>; 3],
        otherwise: &RotationLanes<S>,
    ) -> RotationLanes<S> {
        let smallest = s.splat_f64s(SMALLEST_EDGE);
        let (first, second) = (
            difference(s, &corners[1], &corners[0]),
            difference(s, &corners[2], &corners[0]),
        );
        let length = norm(s, &first);
        let edge = divided(s, &first, length);
        let upright = cross(s, &edge, &second);
        let height = norm(s, &upright);
        let normal = divided(s, &upright, height);
        let across = cross(s, &normal, &edge);
        let in_plane = [
            [dot(s, &first, &edge), dot(s, &second, &edge)],
            [dot(s, &first, &across), dot(s, &second, &across)],
        ];
        let gradient = |i: usize, j: usize| {
            let [a, b] = [0, 1].map(|k| {
                let inverse = s.splat_f64s(self.edges_inverse[(k, j)]);
                s.mul_f64s(in_plane[i][k], inverse)
            });
            s.add_f64s(a, b)
        };
        let sine = s.sub_f64s(gradient(1, 0), gradient(0, 1));
        let cosine = s.add_f64s(gradient(0, 0), gradient(1, 1));
        let radius = gathered(s, |k| number::<S>(&sine, k).hypot(number::<S>(&cosine, k)));
        let along = sum(s, &scaled(s, &edge, cosine), &scaled(s, &across, sine));
        let x = divided(s, &along, radius);
        let rotation = rotation_of_columns(s, &[x, cross(s, &normal, &x), normal]);
        let flat = s.or_m64s(
            s.less_than_or_equal_f64s(length, smallest),
            s.less_than_or_equal_f64s(height, smallest),
        );
        std::array::from_fn(|k| s.select_f64s(flat, otherwise[k], rotation[k]))
    }
}

/// First edge, normal cross edge, normal.
fn edge_axes(corners: &[Vector3<f64>; 3]) -> Option<[Vector3<f64>; 3]> {
    let edge = (corners[1] - corners[0]).try_normalize(SMALLEST_EDGE)?;
    let normal = edge
        .cross(&(corners[2] - corners[0]))
        .try_normalize(SMALLEST_EDGE)?;
    Some([edge, normal.cross(&edge), normal])
}

fn edges_in_plane(corners: &[Vector3<f64>; 3], x: &Vector3<f64>, y: &Vector3<f64>) -> Matrix2<f64> {
    let (first, second) = (corners[1] - corners[0], corners[2] - corners[0]);
    Matrix2::new(first.dot(x), second.dot(x), first.dot(y), second.dot(y))
}

/// The point of a triangle with these weights of its corners.
pub(crate) fn point_of(corners: &[Vector3<f64>; 3], barycentrics: &[f64; 3]) -> Vector3<f64> {
    corners
        .iter()
        .zip(barycentrics)
        .map(|(corner, weight)| corner * *weight)
        .sum()
}

/// [`point_of`] each lane, operation by operation.
#[inline(always)]
pub(crate) fn points_of<S: Simd>(
    s: S,
    corners: &[VectorLanes<S>; 3],
    barycentrics: &[f64; 3],
) -> VectorLanes<S> {
    let mut point = [s.splat_f64s(0.0); 3];
    for (corner, weight) in corners.iter().zip(barycentrics) {
        point = sum(s, &point, &scaled(s, corner, s.splat_f64s(*weight)));
    }
    point
}

#[cfg(test)]
#[path = "rest_triangle_tests.rs"]
mod tests;
