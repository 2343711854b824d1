//! Depth of the skin in front of the pelvis, in the map and on the body.

use cromosim_body::{Joint, ShapedBody};
use nalgebra::{Vector2, Vector3};

use super::{Camera, DepthMap};

/// Radius of the window around the pelvis by the torso's length.
const WINDOW_BY_TORSO: f64 = 0.15;
/// How deep a body is behind its nearest skin, by the torso's length: what is farther is background.
const BODY_DEPTH_BY_TORSO: f64 = 0.6;
/// Fewer known pixels than this are no evidence.
const LEAST_PIXELS: usize = 5;

/// What a map shows around the pelvis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceDepth {
    /// Median of the body's own pixels, in the map's unit.
    pub depth: f64,
    /// Their standard deviation (1.4826 times the median absolute deviation), in the map's unit: shape of the body and noise.
    pub spread: f64,
    /// How many they are.
    pub pixels: usize,
}

/// The median depth in a disc of 0.15 torso lengths around the pelvis, over the body's own pixels: those within 0.6 torso lengths behind
/// the nearest tenth. Between the legs and beside the hips the background shows through; it is farther by more than a body is deep.
/// A torso length in the map's unit is `torso_px depth / focal_px`. `camera`, `pixel` and `torso_px` belong to the keypoints' image.
/// `None` where fewer than 5 pixels are known.
pub fn surface_depth(map: &DepthMap, camera: &Camera, pixel: Vector2<f64>, torso_px: f64) -> Option<SurfaceDepth> {
    let map_px = Vector2::new(map.width() as f64, map.height() as f64).component_div(&camera.image_px);
    let (centre, radius) = (pixel.component_mul(&map_px), (torso_px * WINDOW_BY_TORSO * map_px.y).max(1.5));
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
    Some(SurfaceDepth { depth, spread: 1.4826 * deviations[deviations.len() / 2], pixels: depths.len() })
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

/// The skin around the pelvis of a shaped body at rest: how far in front of the middle of the hips it lies, seen from any side.
#[derive(Clone, Debug)]
pub struct PelvisSkin {
    /// Corners about the middle of the hip joints, model axes, m.
    triangles: Vec<[Vector3<f64>; 3]>,
    /// Neck to middle of the hips, m.
    torso_m: f64,
    pelvis_from_mid_hip: Vector3<f64>,
}

/// Triangles farther from the middle of the hips belong to legs and chest.
const PELVIS_RADIUS_M: f64 = 0.4;
/// Rays of the window: a grid with this many to each side of the middle.
const GRID: i32 = 2;

impl PelvisSkin {
    /// Of a shaped body.
    pub fn new(shaped: &ShapedBody) -> Self {
        let joint = |joint: Joint| shaped.joints_in_model()[joint.index()];
        let mid_hip = (joint(Joint::LeftHip) + joint(Joint::RightHip)) / 2.0;
        let corners = |face: &[u32; 3]| face.map(|vertex| shaped.rest_vertices()[vertex as usize] - mid_hip);
        // Hands hang far from the hips in the T-pose, so that what is near belongs to the trunk and thighs.
        let near = |corners: &[Vector3<f64>; 3]| corners.iter().all(|corner| corner.norm() < PELVIS_RADIUS_M);
        let triangles = shaped.model().faces().iter().map(corners).filter(near).collect();
        let shoulders = (joint(Joint::LeftShoulder) + joint(Joint::RightShoulder)) / 2.0;
        Self { triangles, torso_m: (shoulders - mid_hip).norm(), pelvis_from_mid_hip: joint(Joint::Pelvis) - mid_hip }
    }

    /// The pelvis joint from the middle of the hip joints, pelvis axes, m.
    pub fn pelvis_from_mid_hip(&self) -> Vector3<f64> {
        self.pelvis_from_mid_hip
    }

    /// Distance from the skin to the middle of the hips along the view, m: the median over the window of [`surface_depth`].
    /// `view_in_pelvis` points away from the camera, in pelvis axes.
    pub fn depth_behind_skin(&self, view_in_pelvis: &Vector3<f64>) -> f64 {
        let Some(view) = view_in_pelvis.try_normalize(1e-9) else { return 0.0 };
        let right = view.cross(&if view.y.abs() < 0.9 { Vector3::y() } else { Vector3::x() }).normalize();
        let down = view.cross(&right);
        let step = self.torso_m * WINDOW_BY_TORSO / f64::from(GRID);
        let mut depths = Vec::new();
        for row in -GRID..=GRID {
            for column in (-GRID..=GRID).filter(|column| row * row + column * column <= GRID * GRID) {
                let origin = (right * f64::from(column) + down * f64::from(row)) * step;
                depths.extend(self.first_hit(&origin, &view));
            }
        }
        depths.sort_by(f64::total_cmp);
        depths.get(depths.len() / 2).copied().unwrap_or(0.0)
    }

    /// How far before `origin` a ray along `view` enters the body; `None` where it passes by.
    fn first_hit(&self, origin: &Vector3<f64>, view: &Vector3<f64>) -> Option<f64> {
        let hits = self.triangles.iter().filter_map(|[a, b, c]| {
            let (ab, ac) = (b - a, c - a);
            let normal = view.cross(&ac);
            let determinant = ab.dot(&normal);
            if determinant.abs() < 1e-15 {
                return None;
            }
            let from_a = origin - a;
            let u = from_a.dot(&normal) / determinant;
            let across = from_a.cross(&ab);
            let v = view.dot(&across) / determinant;
            (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| -ac.dot(&across) / determinant)
        });
        hits.max_by(f64::total_cmp)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use cromosim_body::BodyModel;
    use nalgebra::Isometry3;

    use super::*;

    #[test]
    fn the_body_is_told_from_the_background() {
        let camera = Camera::centred(Vector2::new(1500.0, 1500.0), Vector2::new(1920.0, 1080.0), Isometry3::identity());
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
        assert_eq!(surface_depth(&map, &camera, Vector2::new(-300.0, 540.0), 190.0), None, "outside of the image");
        assert_eq!(surface_depth(&map, &camera, Vector2::new(f64::MAX, f64::MAX), 190.0), None);
    }

    #[test]
    fn skin_lies_before_the_hips_on_every_side() {
        let shaped = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let skin = PelvisSkin::new(&shaped);
        let [front, back, left, right] =
            [-Vector3::z(), Vector3::z(), -Vector3::x(), Vector3::x()].map(|view| skin.depth_behind_skin(&view));
        println!("skin before the hips: front {front:.3}, back {back:.3}, left {left:.3}, right {right:.3} m");
        // Half the depth and half the breadth of an adult's hips.
        assert!((0.06..0.16).contains(&front) && (0.06..0.16).contains(&back), "{front} {back}");
        assert!((0.12..0.22).contains(&left) && (left - right).abs() < 0.01, "{left} {right}");
        assert!((0.03..0.12).contains(&skin.pelvis_from_mid_hip().norm()));
    }
}
