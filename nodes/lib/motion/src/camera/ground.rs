//! Which way is up, and where the floor is.

use cromosim_body::{BodyError, BodyPose, ShapedBody, VertexSubset};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// How the up direction is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gravity {
    /// Up, in the reconstruction's world; of any length.
    Given(Vector3<f64>),
    /// The first camera was held level: up is its image's upward direction.
    FirstCamera,
    /// The plane that the lowest points of the feet lie in over time, with the first camera (within some 10 degrees) deciding what the
    /// feet do not tell: the tilt about the line of a straight walk.
    Floor,
}

/// How far from level people hold a camera, rad.
const CAMERA_TILT_STD: f64 = 0.17;
/// How far a foot's lowest point is from the floor, as placed by depth and pose, m.
const FOOT_STD_M: f64 = 0.05;
/// Errors of frames within this time are the same ones, s.
const CORRELATION_S: f64 = 0.5;

/// Points of both soles.
#[derive(Clone, Debug)]
pub struct Soles {
    points: VertexSubset,
}

impl Soles {
    /// Of a shaped body: the outermost of the vertices within 12 mm of the lowest one, on each side.
    ///
    /// # Errors
    /// None for a body that is one; the subset's otherwise.
    pub fn new(shaped: &ShapedBody) -> Result<Self, BodyError> {
        let lowest = shaped.rest_vertices().iter().map(|vertex| vertex.y).fold(f64::MAX, f64::min);
        let mut chosen = Vec::new();
        for side in [1.0, -1.0] {
            let low = || shaped.rest_vertices().iter().enumerate().filter(|(_, v)| v.x * side > 0.0 && v.y < lowest + 0.012);
            for step in 0..8 {
                let angle = f64::from(step) * std::f64::consts::FRAC_PI_4;
                let outwards = Vector3::new(angle.cos(), -0.2, angle.sin());
                chosen.extend(low().max_by(|a, b| a.1.dot(&outwards).total_cmp(&b.1.dot(&outwards))).map(|(index, _)| index as u32));
            }
        }
        Ok(Self { points: shaped.subset(&chosen)? })
    }

    /// The lowest point of both soles in a pose; `None` only for a body without vertices.
    pub fn lowest(&self, pose: &BodyPose, up: &Vector3<f64>) -> Option<Vector3<f64>> {
        self.points.positions(pose).into_iter().min_by(|a, b| a.dot(up).total_cmp(&b.dot(up)))
    }
}

/// The normal of the floor from the lowest points of the feet, starting at `camera_up`: least squares of `(n x_k - h) / 5 cm` and of the
/// angle between n and `camera_up` by 10 degrees, Huber's weights against feet in the air, half a second of frames counted as one.
pub fn floor_normal(lowest_points: &[Vector3<f64>], camera_up: Vector3<f64>, rate_hz: f64) -> Vector3<f64> {
    let across = if camera_up.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    let (mut up, side) = (camera_up.normalize(), camera_up.cross(&across).normalize());
    let ahead = up.cross(&side);
    let centre = lowest_points.iter().sum::<Vector3<f64>>() / lowest_points.len().max(1) as f64;
    let together = (CORRELATION_S * rate_hz).max(1.0);
    let mut height = 0.0;
    for _ in 0..20 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for point in lowest_points {
            let away = point - centre;
            let residual = up.dot(&away) - height;
            let weight = (FOOT_STD_M / residual.abs().max(FOOT_STD_M)) / (together * FOOT_STD_M * FOOT_STD_M);
            let row = Vector3::new(side.dot(&away), ahead.dot(&away), -1.0);
            normal += row * row.transpose() * weight;
            right += row * (weight * -camera_up.normalize().dot(&away));
        }
        let prior = 1.0 / (CAMERA_TILT_STD * CAMERA_TILT_STD);
        normal += Matrix3::from_diagonal(&Vector3::new(prior, prior, 1e-9));
        let Some(factor) = normal.cholesky() else { break };
        let solution = factor.solve(&right);
        up = camera_up.normalize() + side * solution.x + ahead * solution.y;
        height = solution.z;
    }
    up.normalize()
}

/// The turn of a reconstruction's world into one with z up and the horizontal part of `forward` along x.
pub fn upright(up: &Vector3<f64>, forward: &Vector3<f64>) -> UnitQuaternion<f64> {
    let z = up.normalize();
    let level = forward - z * z.dot(forward);
    let x = level.try_normalize(1e-6).unwrap_or_else(|| {
        let other = if z.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
        (other - z * z.dot(&other)).normalize()
    });
    let source_from_world = Matrix3::from_columns(&[x, z.cross(&x), z]);
    UnitQuaternion::from_matrix(&source_from_world).inverse()
}

/// Height of the floor: the median height of the lowest points of the feet. A foot is taken to stand on it in more than half of the frames.
pub fn floor_height(lowest_points: &[Vector3<f64>]) -> f64 {
    let mut heights: Vec<f64> = lowest_points.iter().map(|point| point.z).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floor_is_found_where_feet_tell_and_left_to_the_camera_where_not() {
        let truth = Vector3::new(0.1, -1.0, 0.05).normalize();
        let camera_up = Vector3::new(0.0, -1.0, 0.0);
        let plane = |u: f64, v: f64| {
            let side = truth.cross(&Vector3::z()).normalize();
            side * u + truth.cross(&side) * v + Vector3::new(1.0, 2.0, 4.0)
        };
        let lifted = |k: usize| truth * if k.is_multiple_of(9) { 0.4 } else { 0.0 };
        let square: Vec<_> = (0..900).map(|k| plane((k % 30) as f64 * 0.1, (k / 30) as f64 * 0.1) + lifted(k)).collect();
        let angle = |a: &Vector3<f64>, b: &Vector3<f64>| a.angle(b).to_degrees();
        println!("feet over a square: {:.3} deg off", angle(&floor_normal(&square, camera_up, 30.0), &truth));
        assert!(angle(&floor_normal(&square, camera_up, 30.0), &truth) < 0.5);
        let standing: Vec<_> = (0..300).map(|_| plane(0.0, 0.0)).collect();
        assert!(angle(&floor_normal(&standing, camera_up, 30.0), &camera_up) < 0.01, "who stands still says nothing");
        assert!((upright(&truth, &Vector3::z()) * truth - Vector3::z()).norm() < 1e-12);
        assert!((upright(&truth, &truth) * truth - Vector3::z()).norm() < 1e-12, "a camera that looks up");
    }
}
