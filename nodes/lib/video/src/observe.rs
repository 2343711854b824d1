//! What one frame says about the root: from keypoints, depth and pose to a position with its
//! covariance.

use cromosim_body::ShapedBody;
use nalgebra::{Vector2, Vector3};

use crate::clip::CameraClip;
use crate::depth_map::DepthMap;
use crate::filter::Measurement;
use crate::options::TrajectoryOptions;
use crate::pinhole::Camera;
use crate::scale::position_by_keypoints;
use crate::surface::{PelvisSkin, surface_depth};
use crate::torso::pelvis_pixel;

/// How exactly the skin's distance before the joint is known, m: clothing, and limbs that the pose
/// has elsewhere.
const SKIN_STD_M: f64 = 0.02;

/// One frame, before the scale is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RootObservation {
    /// 0-based.
    pub frame: usize,
    /// Middle of the hips, keypoints' image, px.
    pub pixel: Vector2<f64>,
    /// Its standard deviation, px.
    pub pixel_std: f64,
    /// Of the keypoints, 0 to 1.
    pub confidence: f64,
    /// Depth of the skin along the optical axis, in the map's unit.
    pub skin_depth: f64,
    /// Middle of the hips behind the skin along the ray, m.
    pub behind_skin_m: f64,
    /// From the middle of the hips to the pelvis joint, camera axes, m.
    pub pelvis_from_mid_hip: Vector3<f64>,
    /// Distance of the middle of the hips along the optical axis by keypoints and body size alone,
    /// m; see [`position_by_keypoints`].
    pub distance_by_keypoints_m: Option<f64>,
}

/// The body that frames are read with.
pub struct ObservedBody<'a> {
    /// Shaped by the clip's average betas.
    pub shaped: &'a ShapedBody,
    /// Its skin.
    pub skin: PelvisSkin<'a>,
    /// Factor on the body's size: the known height by its own, 1 where none is known.
    pub size: f64,
}

/// Observes a frame; `None` where keypoints, camera, depth or pose are missing or too unsure.
pub fn observe(
    clip: &CameraClip,
    frame: usize,
    map: &DepthMap,
    body: &mut ObservedBody<'_>,
    options: &TrajectoryOptions,
) -> Option<RootObservation> {
    let person = clip.keypoints.get(frame)?.as_ref()?;
    let camera = clip
        .cameras
        .get(frame)?
        .as_ref()?
        .resized(clip.keypoint_image_px);
    let pose = clip.poses.get(frame).filter(|_| {
        clip.pose_confidence
            .get(frame)
            .is_some_and(|confidence| *confidence > 0.0)
    })?;
    let pelvis = pelvis_pixel(person, options.least_confidence)?;
    let surface = surface_depth(map, &camera, pelvis.pixel, pelvis.torso_px)?;
    let hips = body.skin.hips(pose, &camera.ray(pelvis.pixel));
    let by_keypoints = position_by_keypoints(
        person,
        pose,
        body.shaped,
        body.size,
        &camera,
        options.least_confidence,
    );
    Some(RootObservation {
        frame,
        pixel: pelvis.pixel,
        pixel_std: options.keypoint_std_px * clip.keypoint_image_px.y / 1080.0 * pelvis.spread
            / pelvis.confidence,
        confidence: pelvis.confidence,
        skin_depth: surface.depth,
        behind_skin_m: hips.behind_skin_m * body.size,
        pelvis_from_mid_hip: -hips.mid_hip * body.size,
        distance_by_keypoints_m: by_keypoints.map(|position| position.z),
    })
}

/// The root in the reconstruction's world, metres: `X_w = R_wc (s d K^-1 (u, v, 1) + b r + R_cp
/// (pelvis - mid hip)) + s t_wc`, with r the ray's direction and b how far the hips lie behind the
/// skin. Pixel and depth errors travel through the back-projection: see
/// [`Camera::back_projection_covariance`].
pub fn measure(
    observation: &RootObservation,
    camera: &Camera,
    scale: f64,
    depth_std: f64,
) -> Measurement {
    let camera = camera.scaled(scale);
    let depth = scale * observation.skin_depth;
    let in_camera = camera.back_project(observation.pixel, depth)
        + camera.ray(observation.pixel).normalize() * observation.behind_skin_m
        + observation.pelvis_from_mid_hip;
    let depth_std_m = (depth * depth_std).hypot(SKIN_STD_M);
    let rotation = camera.world_from_camera.rotation.to_rotation_matrix();
    let [covariance_of_pixel, covariance_of_depth] = camera
        .back_projection_covariance(observation.pixel, depth, observation.pixel_std, depth_std_m)
        .map(|covariance| rotation * covariance * rotation.transpose());
    Measurement {
        position: camera.world_from_camera.rotation * in_camera
            + camera.world_from_camera.translation.vector,
        covariance_of_pixel,
        covariance_of_depth,
    }
}
