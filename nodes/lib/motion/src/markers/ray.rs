//! Where a ray leaves the skin.

use cromosim_body::BodyModel;
use nalgebra::Vector3;

/// The first triangle of the mean shape in T-pose that the ray meets, and the barycentrics of the
/// point (Möller and Trumbore 1997).
pub(super) fn site_by_ray(
    body: &BodyModel,
    start: Vector3<f64>,
    direction: Vector3<f64>,
) -> Option<(u32, [f64; 3])> {
    let direction = direction.try_normalize(0.0)?;
    let mut nearest: Option<(f64, u32, [f64; 3])> = None;
    for (index, corners) in body.faces().iter().enumerate() {
        let [a, b, c] = corners.map(|vertex| body.template()[vertex as usize]);
        let Some((distance, barycentrics)) = hit(start, direction, [a, b, c]) else {
            continue;
        };
        if nearest.is_none_or(|(least, ..)| distance < least) {
            nearest = Some((distance, index as u32, barycentrics));
        }
    }
    nearest.map(|(_, triangle, barycentrics)| (triangle, barycentrics))
}

/// Distance and barycentrics where the ray goes out through the triangle.
fn hit(
    start: Vector3<f64>,
    direction: Vector3<f64>,
    [a, b, c]: [Vector3<f64>; 3],
) -> Option<(f64, [f64; 3])> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(&ac);
    let determinant = ab.dot(&p);
    // Triangles are counter-clockwise seen from outside: from inside the determinant is negative.
    if determinant > -1e-15 {
        return None;
    }
    let from_a = start - a;
    let u = from_a.dot(&p) / determinant;
    let q = from_a.cross(&ab);
    let v = direction.dot(&q) / determinant;
    let distance = ac.dot(&q) / determinant;
    // A little slack: a ray through an edge belongs to one of its triangles.
    let inside = u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9;
    (inside && distance > 0.0).then(|| (distance, [(1.0 - u - v).max(0.0), u.max(0.0), v.max(0.0)]))
}
