//! All frames of a clip: the scale of its reconstruction, and what each frame measures.

use cromosim_body::ShapedBody;

use crate::clip::{CameraClip, DepthProvider};
use crate::error::VideoError;
use crate::filter::Measurement;
use crate::observe::{ObservedBody, RootObservation, measure, observe};
use crate::options::TrajectoryOptions;
use crate::pinhole::Camera;
use crate::scale::{ScaleEstimate, ScaleSource, combined_scale, scale_of_frame, standing_height};
use crate::surface::PelvisSkin;

/// Fewer measured frames make no track.
const LEAST_MEASUREMENTS: usize = 10;
/// Scales of frames within this time err alike, s.
const SCALE_BLOCK_S: f64 = 1.0;

/// The scale, and what each frame measures at that scale.
pub(crate) fn measure_frames(
    clip: &CameraClip,
    depths: &mut dyn DepthProvider,
    shaped: &ShapedBody,
    options: &TrajectoryOptions,
) -> Result<(ScaleEstimate, Vec<Option<Measurement>>), VideoError> {
    let size = if let ScaleSource::BodyHeight(height) = options.scale {
        height / standing_height(shaped)
    } else {
        1.0
    };
    let mut body = ObservedBody {
        shaped,
        skin: PelvisSkin::new(shaped),
        size,
    };
    let mut observations: Vec<Option<RootObservation>> = Vec::with_capacity(clip.poses.len());
    for frame in 0..clip.poses.len() {
        let map = depths.depth(frame)?;
        observations.push(map.and_then(|map| observe(clip, frame, &map, &mut body, options)));
    }
    let found = observations.iter().flatten().count();
    if found < LEAST_MEASUREMENTS {
        let (name, frames) = (clip.name.clone(), clip.poses.len());
        return Err(VideoError::TooFewFrames {
            name,
            found,
            frames,
            needed: LEAST_MEASUREMENTS,
        });
    }
    let scale = scale(clip, &observations, options)?;
    let measured = observations
        .iter()
        .zip(&clip.cameras)
        .map(|(observation, camera)| {
            let camera = camera.as_ref()?.resized(clip.keypoint_image_px);
            Some(measure(
                observation.as_ref()?,
                &camera,
                scale.metres_per_unit,
                options.depth_std,
            ))
        });
    Ok((scale, measured.collect()))
}

/// The scale from the source that the options name.
fn scale(
    clip: &CameraClip,
    observations: &[Option<RootObservation>],
    options: &TrajectoryOptions,
) -> Result<ScaleEstimate, VideoError> {
    let problem = |problem: &str| VideoError::Scale {
        name: clip.name.clone(),
        problem: problem.to_owned(),
    };
    match &options.scale {
        ScaleSource::Given(metres_per_unit) => Ok(ScaleEstimate {
            metres_per_unit: *metres_per_unit,
            relative_std: 0.0,
            observations: 0,
        }),
        ScaleSource::BodyHeight(_) => {
            let each = scales_by_body_height(clip, observations);
            let block = (SCALE_BLOCK_S * clip.rate_hz).round().max(1.0) as usize;
            combined_scale(&each, block)
                .ok_or_else(|| problem("in no frame are six joints of the body seen"))
        }
    }
}

/// The scale of each frame in which the body's keypoints tell the distance, with its weight.
fn scales_by_body_height(
    clip: &CameraClip,
    observations: &[Option<RootObservation>],
) -> Vec<(f64, f64)> {
    let scale = |observation: &RootObservation, camera: &Camera| {
        let ray = camera
            .resized(clip.keypoint_image_px)
            .ray(observation.pixel);
        let behind_skin = observation.behind_skin_m / ray.norm();
        let scale = scale_of_frame(
            observation.distance_by_keypoints_m?,
            behind_skin,
            observation.skin_depth,
        )?;
        Some((scale, observation.confidence))
    };
    observations
        .iter()
        .zip(&clip.cameras)
        .filter_map(|(observation, camera)| scale(observation.as_ref()?, camera.as_ref()?))
        .collect()
}
