//! Metres per unit of the reconstruction.

use cromosim_body::{BodyPose, Joint, ShapedBody};
use nalgebra::{Matrix3, Vector2, Vector3};

use super::{Camera, DepthMap, PersonKeypoints};

/// Where the scale comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum ScaleSource {
    /// Metres per unit, known: 1 for metric depth.
    Given(f64),
    /// The person's standing height, m: the estimated pose at this size says how far away the person is.
    BodyHeight(f64),
    /// The length of something that stands still or moves along, seen in one frame or several.
    Object(Vec<ObjectLength>),
}

/// A known length between two pixels of one frame; keypoints' image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectLength {
    /// 0-based.
    pub frame: usize,
    /// One end, px.
    pub from: Vector2<f64>,
    /// The other end, px.
    pub to: Vector2<f64>,
    /// Distance of the two, m.
    pub length_m: f64,
}

/// The scale and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleEstimate {
    /// Metres per unit of the reconstruction.
    pub metres_per_unit: f64,
    /// Its standard deviation by itself: 0.02 is 2 %. 0 where it was given.
    pub relative_std: f64,
    /// How many frames or lengths it rests on; 0 where it was given.
    pub observations: usize,
}

/// BODY_25's points that lie on joints of SMPL.
const JOINTS: [(usize, Joint); 12] = [
    (2, Joint::RightShoulder),
    (3, Joint::RightElbow),
    (4, Joint::RightWrist),
    (5, Joint::LeftShoulder),
    (6, Joint::LeftElbow),
    (7, Joint::LeftWrist),
    (9, Joint::RightHip),
    (10, Joint::RightKnee),
    (11, Joint::RightAnkle),
    (12, Joint::LeftHip),
    (13, Joint::LeftKnee),
    (14, Joint::LeftAnkle),
];
/// The estimate of a distance needs at least so many points.
const LEAST_POINTS: usize = 6;

/// How tall a body stands, m: height of its mesh at rest.
pub fn standing_height(shaped: &ShapedBody) -> f64 {
    let heights = || shaped.rest_vertices().iter().map(|vertex| vertex.y);
    heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min)
}

/// Where a body of known size and pose is by its keypoints alone: the middle of the hips in camera axes, m.
///
/// With points p_j of the body about the middle of its hips (camera axes, m) and rays (a_j, b_j, 1) = K^-1 (u_j, v_j, 1), perspective says
/// `X - a_j Z = a_j z_j - x_j` and `Y - b_j Z = b_j z_j - y_j`: least squares in (X, Y, Z), weighted by confidence, with Huber's weights
/// (three rounds) against limbs that the pose has elsewhere. `size` multiplies the body. `None` with fewer than 6 points.
pub fn position_by_keypoints(
    person: &PersonKeypoints,
    pose: &BodyPose,
    shaped: &ShapedBody,
    size: f64,
    camera: &Camera,
    least_confidence: f64,
) -> Option<Vector3<f64>> {
    let segments = shaped.world_from_segments(&BodyPose { root_position: Vector3::zeros(), ..pose.clone() });
    let place = |joint: Joint| segments[joint.index()].translation.vector;
    let mid_hip = (place(Joint::LeftHip) + place(Joint::RightHip)) / 2.0;
    let points: Vec<(Vector3<f64>, Vector3<f64>, f64)> = JOINTS
        .iter()
        .map(|&(index, joint)| (&person[index], joint))
        .filter(|(point, _)| point.confidence >= least_confidence && point.confidence > 0.0)
        .map(|(point, joint)| (camera.ray(Vector2::new(point.u, point.v)), (place(joint) - mid_hip) * size, point.confidence))
        .collect();
    if points.len() < LEAST_POINTS {
        return None;
    }
    let mut weights: Vec<f64> = points.iter().map(|(_, _, confidence)| confidence * confidence).collect();
    let mut position = None;
    for _ in 0..3 {
        let solved = solve(&points, &weights)?;
        let residuals: Vec<f64> = points.iter().map(|(ray, point, _)| residual(ray, point, &solved).norm()).collect();
        let mut sorted = residuals.clone();
        sorted.sort_by(f64::total_cmp);
        let limit = 2.0 * sorted[sorted.len() / 2] + 1e-12;
        for ((weight, residual), (_, _, confidence)) in weights.iter_mut().zip(&residuals).zip(&points) {
            *weight = confidence * confidence * (limit / residual.max(limit));
        }
        position = Some(solved);
    }
    position.filter(|position: &Vector3<f64>| position.z > 0.0 && position.iter().all(|value| value.is_finite()))
}

fn solve(points: &[(Vector3<f64>, Vector3<f64>, f64)], weights: &[f64]) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for ((ray, point, _), weight) in points.iter().zip(weights) {
        for axis in 0..2 {
            let mut row = Vector3::ith(axis, 1.0);
            row.z = -ray[axis];
            normal += row * row.transpose() * *weight;
            right += row * (*weight * (ray[axis] * point.z - point[axis]));
        }
    }
    Some(normal.cholesky()?.solve(&right))
}

fn residual(ray: &Vector3<f64>, point: &Vector3<f64>, position: &Vector3<f64>) -> Vector2<f64> {
    let placed = point + position;
    (placed - ray * placed.z).xy()
}

/// Metres per unit from one frame's distance by keypoints and its depth map: the skin lies `behind_skin_m` (along the axis) before the
/// middle of the hips, so that `s = (Z - behind_skin) / d`.
pub fn scale_of_frame(distance_m: f64, behind_skin_m: f64, depth: f64) -> Option<f64> {
    Some((distance_m - behind_skin_m) / depth).filter(|scale| scale.is_finite() && *scale > 0.0)
}

/// The weighted median of the frames' scales. Its error: frames next to each other err alike, so that the scatter of the medians of
/// `block` frames is taken, by the square root of the number of blocks (1.2533 for the median of normal values).
pub fn combined_scale(scales: &[(f64, f64)], block: usize) -> Option<ScaleEstimate> {
    let metres_per_unit = weighted_median(scales)?;
    let blocks: Vec<f64> = scales.chunks(block.max(1)).filter_map(weighted_median).collect();
    let mean = blocks.iter().sum::<f64>() / blocks.len() as f64;
    let variance = blocks.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (blocks.len().max(2) - 1) as f64;
    let relative_std = 1.2533 * (variance / blocks.len() as f64).sqrt() / metres_per_unit;
    Some(ScaleEstimate { metres_per_unit, relative_std, observations: scales.len() })
}

fn weighted_median(values: &[(f64, f64)]) -> Option<f64> {
    let mut sorted: Vec<&(f64, f64)> = values.iter().filter(|(_, weight)| *weight > 0.0).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = sorted.iter().map(|(_, weight)| weight).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    sorted
        .iter()
        .find(|(_, weight)| {
            sum += weight;
            sum >= half
        })
        .map(|(value, _)| *value)
}

/// Metres per unit from one known length: `s = L / |d_1 K^-1 (u_1, v_1, 1) - d_2 K^-1 (u_2, v_2, 1)|`, each depth the median of the 5 x 5
/// pixels around its end. `None` where the map knows nothing there.
pub fn scale_of_object(object: &ObjectLength, map: &DepthMap, camera: &Camera) -> Option<f64> {
    let end = |pixel: Vector2<f64>| Some(camera.back_project(pixel, median_around(map, camera, pixel)?));
    let length = (end(object.from)? - end(object.to)?).norm();
    Some(object.length_m / length).filter(|scale| scale.is_finite() && *scale > 0.0)
}

fn median_around(map: &DepthMap, camera: &Camera, pixel: Vector2<f64>) -> Option<f64> {
    let centre = pixel.component_div(&camera.image_px).component_mul(&Vector2::new(map.width() as f64, map.height() as f64));
    let index = |value: f64, step: i64| usize::try_from(value.floor() as i64 + step).ok();
    let mut depths = Vec::new();
    for (row, column) in (-2..=2).flat_map(|row| (-2..=2).map(move |column| (row, column))) {
        if let (Some(row), Some(column)) = (index(centre.y, row), index(centre.x, column)) {
            depths.extend(map.at(column, row));
        }
    }
    depths.sort_by(f64::total_cmp);
    depths.get(depths.len() / 2).copied()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use cromosim_body::BodyModel;
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::super::{BODY_25_COUNT, Keypoint};
    use super::*;

    fn camera() -> Camera {
        Camera::centred(Vector2::new(1500.0, 1500.0), Vector2::new(1920.0, 1080.0), Isometry3::identity())
    }

    #[test]
    fn distance_and_height_follow_each_other() {
        let shaped = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let mut pose = BodyPose::rest(Vector3::new(0.4, 0.1, 4.5));
        pose.local_rotations[0] = UnitQuaternion::from_scaled_axis(Vector3::new(std::f64::consts::PI, 0.3, 0.2));
        let segments = shaped.world_from_segments(&pose);
        let mut person = [Keypoint::default(); BODY_25_COUNT];
        for (index, joint) in JOINTS {
            let pixel = camera().project(&segments[joint.index()].translation.vector).unwrap();
            person[index] = Keypoint { u: pixel.x, v: pixel.y, confidence: 0.9 };
        }
        let place = |joint: Joint| segments[joint.index()].translation.vector;
        let mid_hip = (place(Joint::LeftHip) + place(Joint::RightHip)) / 2.0;
        let found = position_by_keypoints(&person, &pose, &shaped, 1.0, &camera(), 0.3).unwrap();
        assert!((found - mid_hip).norm() < 1e-9, "{found} {mid_hip}");
        // The same picture shows a person a tenth taller a tenth farther away.
        let taller = position_by_keypoints(&person, &pose, &shaped, 1.1, &camera(), 0.3).unwrap();
        assert!((taller - mid_hip * 1.1).norm() < 1e-9);
        person[4].u += 200.0;
        let robust = position_by_keypoints(&person, &pose, &shaped, 1.0, &camera(), 0.3).unwrap();
        println!("one wrist 200 px away moves the body by {:.3} m", (robust - mid_hip).norm());
        assert!((robust - mid_hip).norm() < 0.15);
        assert!((standing_height(&shaped) - 1.70).abs() < 0.02, "{}", standing_height(&shaped));
    }

    #[test]
    fn a_known_length_gives_the_scale() {
        // A plane at 2 units; 300 px are 0.4 units, and were 0.6 m.
        let map = DepthMap::new(384, 216, vec![2.0; 384 * 216]).unwrap();
        let object = ObjectLength { frame: 0, from: Vector2::new(800.0, 500.0), to: Vector2::new(1100.0, 500.0), length_m: 0.6 };
        assert!((scale_of_object(&object, &map, &camera()).unwrap() - 1.5).abs() < 1e-9);
        let unknown = DepthMap::new(2, 2, vec![0.0; 4]).unwrap();
        assert_eq!(scale_of_object(&object, &unknown, &camera()), None);
    }

    #[test]
    fn frames_combine_by_their_weighted_median() {
        let scales: Vec<(f64, f64)> = (0..100).map(|k| (if k % 10 == 0 { 9.0 } else { 1.5 + 0.01 * f64::from(k % 3) }, 1.0)).collect();
        let combined = combined_scale(&scales, 10).unwrap();
        assert!((combined.metres_per_unit - 1.51).abs() < 1e-12 && combined.relative_std < 0.01, "{combined:?}");
        assert_eq!(combined_scale(&[], 10), None);
    }
}
