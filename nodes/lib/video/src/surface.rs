//! Depth of the skin in front of the pelvis, in the map and on the body.

use cromosim_body::{BodyPose, Joint, ShapedBody};
use nalgebra::{Vector2, Vector3};

use crate::depth_map::DepthMap;
use crate::pinhole::Camera;

/// Radius of the window around the pelvis by the torso's length.
const WINDOW_BY_TORSO: f64 = 0.15;
/// How deep a body is behind its nearest skin, by the torso's length: what is farther is
/// background.
const BODY_DEPTH_BY_TORSO: f64 = 0.6;
/// Fewer known pixels than this are no evidence.
const LEAST_PIXELS: usize = 5;

/// What a map shows around the pelvis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceDepth {
    /// Median of the body's own pixels, in the map's unit.
    pub depth: f64,
    /// Their standard deviation (1.4826 times the median absolute deviation), in the map's unit:
    /// shape of the body and noise.
    pub spread: f64,
    /// How many they are.
    pub pixels: usize,
}

/// The median depth in a disc of 0.15 torso lengths around the pelvis, over the body's own pixels:
/// those within 0.6 torso lengths behind the nearest tenth. Between the legs and beside the hips
/// the background shows through; it is farther by more than a body is deep. A torso length in the
/// map's unit is `torso_px depth / focal_px`. `camera`, `pixel` and `torso_px` belong to the
/// keypoints' image. `None` where fewer than 5 pixels are known.
pub fn surface_depth(
    map: &DepthMap,
    camera: &Camera,
    pixel: Vector2<f64>,
    torso_px: f64,
) -> Option<SurfaceDepth> {
    let map_px =
        Vector2::new(map.width() as f64, map.height() as f64).component_div(&camera.image_px);
    let (centre, radius) = (
        pixel.component_mul(&map_px),
        (torso_px * WINDOW_BY_TORSO * map_px.y).max(1.5),
    );
    let mut depths = disc(map, centre, radius);
    if depths.len() < LEAST_PIXELS {
        return None;
    }
    depths.sort_by(f64::total_cmp);
    let nearest = depths[depths.len() / 10];
    let farthest = nearest * (1.0 + BODY_DEPTH_BY_TORSO * torso_px / camera.focal_px.y);
    depths.retain(|depth| *depth <= farthest);
    if depths.len() < LEAST_PIXELS {
        return None;
    }
    let depth = depths[depths.len() / 2];
    let mut deviations: Vec<f64> = depths.iter().map(|value| (value - depth).abs()).collect();
    deviations.sort_by(f64::total_cmp);
    Some(SurfaceDepth {
        depth,
        spread: 1.4826 * deviations[deviations.len() / 2],
        pixels: depths.len(),
    })
}

/// Known depths of the pixels whose centres lie in the disc.
fn disc(map: &DepthMap, centre: Vector2<f64>, radius: f64) -> Vec<f64> {
    let range = |middle: f64, size: usize| {
        let low = (middle - radius - 0.5).max(0.0).min(size as f64) as usize;
        low..((middle + radius + 0.5).max(0.0).min(size as f64) as usize)
    };
    let mut depths = Vec::new();
    for row in range(centre.y, map.height()) {
        for column in range(centre.x, map.width()) {
            let away = Vector2::new(column as f64 + 0.5, row as f64 + 0.5) - centre;
            if away.norm_squared() <= radius * radius {
                depths.extend(map.at(column, row));
            }
        }
    }
    depths
}

/// What a body shows before its hips: the skin of its pose, arms and thighs included, seen from any
/// side.
#[derive(Clone, Debug)]
pub struct PelvisSkin<'a> {
    shaped: &'a ShapedBody,
    /// Neck to middle of the hips, m.
    torso_m: f64,
    vertices: Vec<[f32; 3]>,
}

/// A pose's hips in camera axes, root at the origin, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosedHips {
    /// The middle of the hip joints.
    pub mid_hip: Vector3<f64>,
    /// How far the skin lies before it along the view.
    pub behind_skin_m: f64,
}

/// Rays of the window: a grid with this many to each side of the middle.
const GRID: i32 = 2;

impl<'a> PelvisSkin<'a> {
    /// Of a shaped body.
    pub fn new(shaped: &'a ShapedBody) -> Self {
        let joint = |joint: Joint| shaped.joints_in_model()[joint.index()];
        let mid_hip = (joint(Joint::LeftHip) + joint(Joint::RightHip)) / 2.0;
        let shoulders = (joint(Joint::LeftShoulder) + joint(Joint::RightShoulder)) / 2.0;
        Self {
            shaped,
            torso_m: (shoulders - mid_hip).norm(),
            vertices: Vec::new(),
        }
    }

    /// The hips of a pose in camera axes, its root position left out. How far they lie behind the
    /// skin is the median over the window of [`surface_depth`], which sees arms that hang before
    /// the hips as well. `view` points away from the camera.
    pub fn hips(&mut self, pose: &BodyPose, view: &Vector3<f64>) -> PosedHips {
        let pose = BodyPose {
            root_position: Vector3::zeros(),
            ..pose.clone()
        };
        let segments = self.shaped.world_from_segments(&pose);
        let place = |joint: Joint| segments[joint.index()].translation.vector;
        let mid_hip = (place(Joint::LeftHip) + place(Joint::RightHip)) / 2.0;
        let Some(view) = view.try_normalize(1e-9) else {
            return PosedHips {
                mid_hip,
                behind_skin_m: 0.0,
            };
        };
        self.shaped.skin(&pose, &mut self.vertices);
        let right = view
            .cross(&if view.y.abs() < 0.9 {
                Vector3::y()
            } else {
                Vector3::x()
            })
            .normalize();
        let down = view.cross(&right);
        // Across the view in steps of the grid, and before the hips.
        let step = self.torso_m * WINDOW_BY_TORSO / f64::from(GRID);
        let seen = |vertex: &[f32; 3]| {
            let away = Vector3::from(vertex.map(f64::from)) - mid_hip;
            (
                Vector2::new(right.dot(&away), down.dot(&away)) / step,
                -view.dot(&away),
            )
        };
        let corners: Vec<(Vector2<f64>, f64)> = self.vertices.iter().map(seen).collect();
        let mut before = first_hits(self.shaped.model().faces(), &corners);
        before.sort_by(|a, b| b.total_cmp(a));
        let nearest = before.get(before.len() / 10).copied().unwrap_or(0.0);
        before.retain(|distance| *distance >= nearest - BODY_DEPTH_BY_TORSO * self.torso_m);
        PosedHips {
            mid_hip,
            behind_skin_m: before.get(before.len() / 2).copied().unwrap_or(0.0),
        }
    }
}

/// For each ray of the round window that meets the body, how far before the middle its first skin
/// is. Corners are in steps of the grid.
fn first_hits(faces: &[[u32; 3]], corners: &[(Vector2<f64>, f64)]) -> Vec<f64> {
    let side = (2 * GRID + 1) as usize;
    let mut hits = vec![f64::NEG_INFINITY; side * side];
    let reach = f64::from(GRID);
    for face in faces {
        let [
            Some((a, a_before)),
            Some((b, b_before)),
            Some((c, c_before)),
        ] = face.map(|vertex| corners.get(vertex as usize))
        else {
            continue;
        };
        let area = (b - a).perp(&(c - a));
        let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
        if low.max() > reach || high.min() < -reach || area == 0.0 {
            continue;
        }
        for row in low.y.max(-reach).ceil() as i32..=high.y.min(reach).floor() as i32 {
            for column in low.x.max(-reach).ceil() as i32..=high.x.min(reach).floor() as i32 {
                let point = Vector2::new(f64::from(column), f64::from(row));
                let weights = [
                    (c - b).perp(&(point - b)),
                    (a - c).perp(&(point - c)),
                    (b - a).perp(&(point - a)),
                ]
                .map(|part| part / area);
                if row * row + column * column <= GRID * GRID
                    && weights.iter().all(|weight| *weight >= 0.0)
                {
                    let hit = &mut hits[(row + GRID) as usize * side + (column + GRID) as usize];
                    *hit = hit
                        .max(weights[0] * a_before + weights[1] * b_before + weights[2] * c_before);
                }
            }
        }
    }
    hits.retain(|hit| hit.is_finite());
    hits
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use cromosim_body::BodyModel;
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;

    #[test]
    fn the_body_is_told_from_the_background() {
        let camera = Camera::centred(
            Vector2::new(1500.0, 1500.0),
            Vector2::new(1920.0, 1080.0),
            Isometry3::identity(),
        );
        // A body of 30 % of the window before a wall, one pixel in seven unknown.
        let depths = (0..384 * 216)
            .map(|pixel| {
                if pixel % 7 == 0 {
                    0.0
                } else if pixel % 384 < 190 {
                    4.0
                } else {
                    6.5
                }
            })
            .collect();
        let map = DepthMap::new(384, 216, depths).unwrap();
        let found = surface_depth(&map, &camera, Vector2::new(960.0, 540.0), 190.0).unwrap();
        assert_eq!((found.depth, found.spread), (4.0, 0.0));
        assert_eq!(
            surface_depth(&map, &camera, Vector2::new(-300.0, 540.0), 190.0),
            None,
            "outside of the image"
        );
        assert_eq!(
            surface_depth(&map, &camera, Vector2::new(f64::MAX, f64::MAX), 190.0),
            None
        );
    }

    #[test]
    fn skin_lies_before_the_hips_on_every_side() {
        let shaped = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let mut skin = PelvisSkin::new(&shaped);
        let mut pose = BodyPose::rest(Vector3::new(3.0, 4.0, 5.0));
        let views = [-Vector3::z(), Vector3::z(), -Vector3::x(), Vector3::x()];
        let [front, back, left, right] = views.map(|view| skin.hips(&pose, &view).behind_skin_m);
        println!(
            "skin before the hips: front {front:.3}, back {back:.3}, left {left:.3}, right {right:.3} m"
        );
        // Half the depth and half the breadth of an adult's hips.
        assert!(
            (0.06..0.16).contains(&front) && (0.06..0.16).contains(&back),
            "{front} {back}"
        );
        assert!(
            (0.12..0.22).contains(&left) && (left - right).abs() < 0.01,
            "{left} {right}"
        );
        assert!(
            (0.03..0.12).contains(&skin.hips(&pose, &Vector3::z()).mid_hip.norm()),
            "the pelvis joint is somewhat above the hips"
        );
        // The left arm hangs down before the left hip.
        pose.local_rotations[Joint::LeftShoulder.index()] =
            UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, -1.45));
        let arm = skin.hips(&pose, &-Vector3::x()).behind_skin_m;
        println!("with an arm before them: {arm:.3} m");
        assert!(
            arm > left + 0.02
                && (skin.hips(&pose, &Vector3::x()).behind_skin_m - right).abs() < 1e-6
        );
    }
}
