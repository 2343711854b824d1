//! Which way is up, and where the floor is.

use cromosim_body::{BodyError, BodyPose, ShapedBody, VertexSubset};
use nalgebra::{Matrix2, Matrix3, UnitQuaternion, Vector2, Vector3};

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
    /// Of a shaped body: the outermost of the vertices within 12 mm of the lowest one, on each
    /// side.
    ///
    /// # Errors
    /// [`BodyError::UnknownVertex`], which a sound body does not give.
    pub fn new(shaped: &ShapedBody) -> Result<Self, BodyError> {
        let lowest = shaped
            .rest_vertices()
            .iter()
            .map(|vertex| vertex.y)
            .fold(f64::MAX, f64::min);
        let mut chosen = Vec::new();
        for side in [1.0, -1.0] {
            let low = || {
                shaped
                    .rest_vertices()
                    .iter()
                    .enumerate()
                    .filter(|(_, v)| v.x * side > 0.0 && v.y < lowest + 0.012)
            };
            for step in 0..8 {
                let angle = f64::from(step) * std::f64::consts::FRAC_PI_4;
                let outwards = Vector3::new(angle.cos(), -0.2, angle.sin());
                chosen.extend(
                    low()
                        .max_by(|a, b| a.1.dot(&outwards).total_cmp(&b.1.dot(&outwards)))
                        .map(|(index, _)| index as u32),
                );
            }
        }
        Ok(Self {
            points: shaped.subset(&chosen)?,
        })
    }

    /// The lowest point of both soles in a pose; `None` only for a body without vertices.
    pub fn lowest(&self, pose: &BodyPose, up: &Vector3<f64>) -> Option<Vector3<f64>> {
        self.points
            .positions(pose)
            .into_iter()
            .min_by(|a, b| a.dot(up).total_cmp(&b.dot(up)))
    }
}

/// What tells the floor's normal beside the feet.
#[derive(Clone, Copy, Debug)]
pub struct UpHints {
    /// Up as the camera is held; within some 10 degrees.
    pub camera: Vector3<f64>,
    /// Mean direction of the trunk, of length 1 times how steady it is: the mean of unit vectors.
    /// People lean by some 5 degrees, and by more the less steady they are.
    pub trunk: Vector3<f64>,
}

/// How far the trunk of people who walk and stand leans, rad.
const TRUNK_LEAN_STD: f64 = 0.09;

/// The normal of the floor from the lowest points of the feet and how far each may be displaced
/// along its line of sight (one standard deviation of the depth), m: least squares of `(n x_k - h)
/// / s` with `s^2 = (5 cm)^2 + (n e_k)^2`, Huber's weights against feet in the air, half a second
/// of frames counted as one; and of the angles between n and the hints by their standard
/// deviations. Displacements also widen the points' spread along the lines of sight and so would
/// tilt the plane towards these: their expected share is taken off the normal equations (errors in
/// variables), and a direction counts by the share of its spread that is left.
pub fn floor_normal(
    feet: &[(Vector3<f64>, Vector3<f64>)],
    hints: &UpHints,
    rate_hz: f64,
) -> Vector3<f64> {
    let start = hints.camera.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let across = if start.x.abs() < 0.8 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let side = start.cross(&across).normalize();
    let basis = [side, start.cross(&side)];
    let flat = |vector: &Vector3<f64>| Vector2::new(basis[0].dot(vector), basis[1].dot(vector));
    let steadiness = hints.trunk.norm().clamp(1e-6, 1.0);
    let scatter = 2.0 * (1.0 - steadiness);
    let (trunk, trunk_precision) = (
        flat(&(hints.trunk / steadiness)),
        (TRUNK_LEAN_STD * TRUNK_LEAN_STD + scatter).recip(),
    );
    let camera_precision = (CAMERA_TILT_STD * CAMERA_TILT_STD).recip();
    let prior = Matrix2::identity() * (camera_precision + trunk_precision);
    let mut slope = Vector2::<f64>::zeros();
    for _ in 0..20 {
        let up = (start + basis[0] * slope.x + basis[1] * slope.y).normalize();
        let Some(data) = PlaneSums::new(feet, &up, &start, flat, rate_hz) else {
            break;
        };
        let (information, pull) = data.reliable();
        let Some(factor) = (information + prior).cholesky() else {
            break;
        };
        slope = factor.solve(&(pull + trunk * trunk_precision));
    }
    (start + basis[0] * slope.x + basis[1] * slope.y).normalize()
}

/// Normal equations of the plane's slope about `start`, its height already eliminated by the
/// weighted mean.
struct PlaneSums {
    information: Matrix2<f64>,
    pull: Vector2<f64>,
    noise: Matrix2<f64>,
    noise_pull: Vector2<f64>,
}

impl PlaneSums {
    /// Information and pull without the displacements' share: along each principal direction v with
    /// `l = v (I - N) v` left of the spread, the slope is that of `I - N`, its information `l^2 /
    /// (l + v N v)`; nothing where l is not positive.
    fn reliable(&self) -> (Matrix2<f64>, Vector2<f64>) {
        let pull = self.pull - self.noise_pull;
        let eigen = (self.information - self.noise).symmetric_eigen();
        let (mut information, mut pulled) = (Matrix2::zeros(), Vector2::zeros());
        for (&left, direction) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            let noise = direction.dot(&(self.noise * direction));
            if left > 0.0 {
                let kept = left / (left + noise);
                information += direction * direction.transpose() * (left * kept);
                pulled += direction * (direction.dot(&pull) * kept);
            }
        }
        (information, pulled)
    }

    /// Sums about the plane of normal `up`; `None` without feet. `flat` gives a vector's two
    /// coordinates across `start`.
    fn new(
        feet: &[(Vector3<f64>, Vector3<f64>)],
        up: &Vector3<f64>,
        start: &Vector3<f64>,
        flat: impl Fn(&Vector3<f64>) -> Vector2<f64>,
        rate_hz: f64,
    ) -> Option<Self> {
        let together = (CORRELATION_S * rate_hz).max(1.0);
        let mut heights: Vec<f64> = feet.iter().map(|(point, _)| up.dot(point)).collect();
        heights.sort_by(f64::total_cmp);
        let middle = *heights.get(heights.len() / 2)?;
        let weight = |(point, displaced): &(Vector3<f64>, Vector3<f64>)| {
            let variance = FOOT_STD_M * FOOT_STD_M + up.dot(displaced).powi(2);
            let away = (up.dot(point) - middle).abs() / variance.sqrt();
            1.0 / (variance * together * away.max(1.0))
        };
        let total: f64 = feet.iter().map(weight).sum();
        let centre = feet
            .iter()
            .map(|foot| foot.0 * weight(foot))
            .sum::<Vector3<f64>>()
            / total;
        let mut sums = Self {
            information: Matrix2::zeros(),
            pull: Vector2::zeros(),
            noise: Matrix2::zeros(),
            noise_pull: Vector2::zeros(),
        };
        for foot in feet {
            let (weight, away, displaced) = (weight(foot), foot.0 - centre, foot.1);
            sums.information += flat(&away) * flat(&away).transpose() * weight;
            sums.pull -= flat(&away) * (weight * start.dot(&away));
            sums.noise += flat(&displaced) * flat(&displaced).transpose() * weight;
            sums.noise_pull -= flat(&displaced) * (weight * start.dot(&displaced));
        }
        Some(sums)
    }
}

/// The turn of a reconstruction's world into one with z up and the horizontal part of `forward`
/// along x.
pub fn upright(up: &Vector3<f64>, forward: &Vector3<f64>) -> UnitQuaternion<f64> {
    let z = up.normalize();
    let level = forward - z * z.dot(forward);
    let x = level.try_normalize(1e-6).unwrap_or_else(|| {
        let other = if z.x.abs() < 0.8 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        (other - z * z.dot(&other)).normalize()
    });
    let source_from_world = Matrix3::from_columns(&[x, z.cross(&x), z]);
    UnitQuaternion::from_matrix(&source_from_world).inverse()
}

/// Height of the floor: the median height of the lowest points of the feet. A foot is taken to
/// stand on it in more than half of the frames.
pub fn floor_height(lowest_points: &[Vector3<f64>]) -> f64 {
    let mut heights: Vec<f64> = lowest_points.iter().map(|point| point.z).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
        a.angle(b).to_degrees()
    }

    #[test]
    fn the_floor_is_found_where_feet_tell_and_left_to_the_hints_where_not() {
        let truth = Vector3::new(0.1, -1.0, 0.05).normalize();
        let camera = Vector3::new(0.0, -1.0, 0.0);
        let plane = |u: f64, v: f64| {
            let side = truth.cross(&Vector3::z()).normalize();
            side * u + truth.cross(&side) * v + Vector3::new(1.0, 2.0, 4.0)
        };
        let lifted = |k: usize| truth * if k.is_multiple_of(9) { 0.4 } else { 0.0 };
        let none = Vector3::zeros();
        let square: Vec<_> = (0..900)
            .map(|k| {
                (
                    plane((k % 30) as f64 * 0.1, (k / 30) as f64 * 0.1) + lifted(k),
                    none,
                )
            })
            .collect();
        let hints = UpHints {
            camera,
            trunk: camera * 0.95,
        };
        println!(
            "feet over a square: {:.3} deg off",
            angle(&floor_normal(&square, &hints, 30.0), &truth)
        );
        assert!(angle(&floor_normal(&square, &hints, 30.0), &truth) < 1.0);
        let standing: Vec<_> = (0..300).map(|_| (plane(0.0, 0.0), none)).collect();
        assert!(
            angle(&floor_normal(&standing, &hints, 30.0), &camera) < 0.01,
            "who stands still says nothing"
        );
        let upright_trunk = UpHints {
            camera,
            trunk: truth * 0.999,
        };
        assert!(
            angle(&floor_normal(&standing, &upright_trunk, 30.0), &truth)
                < 0.5 * angle(&camera, &truth),
            "the trunk is nearer"
        );
        assert_eq!(floor_normal(&[], &hints, 30.0), camera);
    }

    #[test]
    fn errors_of_the_depth_do_not_tilt_the_floor_towards_the_line_of_sight() {
        // A straight walk along x on z = 0, seen from the side and above: every foot is displaced
        // along a line of sight that falls by 20 degrees.
        let sight = Vector3::new(0.0, 0.94, -0.34);
        let feet: Vec<_> = (0..300)
            .map(|k| {
                (
                    Vector3::new(f64::from(k) * 0.015, 0.0, 0.0)
                        + sight * (0.2 * (f64::from(k) * 0.05).sin()),
                    sight * 0.15,
                )
            })
            .collect();
        let hints = UpHints {
            camera: Vector3::new(0.0, 0.08, 1.0),
            trunk: Vector3::z() * 0.995,
        };
        let tilt = angle(&floor_normal(&feet, &hints, 30.0), &Vector3::z());
        let naive: Vec<_> = feet
            .iter()
            .map(|(point, _)| (*point, Vector3::zeros()))
            .collect();
        let naive = angle(&floor_normal(&naive, &hints, 30.0), &Vector3::z());
        println!("tilt {tilt:.2} deg, {naive:.2} deg where the points are taken as exact");
        assert!(tilt < 3.0 && naive > 8.0);
    }

    #[test]
    fn upright_is_up() {
        let up = Vector3::new(0.1, -1.0, 0.05).normalize();
        assert!((upright(&up, &Vector3::z()) * up - Vector3::z()).norm() < 1e-12);
        assert!(
            (upright(&up, &up) * up - Vector3::z()).norm() < 1e-12,
            "a camera that looks up"
        );
        let ahead = upright(&up, &Vector3::z()) * Vector3::z();
        assert!(ahead.x > 0.9 && ahead.y.abs() < 1e-12);
    }
}
