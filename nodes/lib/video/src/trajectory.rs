//! The steps in order: from a camera's clip to a motion in the world.

use std::sync::Arc;

use cromosim_body::{BodyModel, ShapedBody};
use nalgebra::{Isometry3, Vector3};

use crate::observe::{ObservedBody, RootObservation, measure, observe};
use crate::placed::placed;
use crate::stand::{InSource, Upright, mean_up, stand_up};
use crate::{
    Camera, CameraClip, CameraError, DepthProvider, FilterNoise, GATE, Gate, Gravity, Measurement,
    PelvisSkin, RootState, ScaleEstimate, ScaleSource, TrajectoryReport, average_betas,
    combined_scale, confidence_of_std, kalman_filter, learn_noise, scale_of_frame, scale_of_object,
    standing_height,
};
use cromosim_motion::{SmplMotion, continuous};

/// Whether the root moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Trajectory {
    /// From depth maps: the paper's CROMOSim.
    #[default]
    Depth,
    /// The root stays where it is: the paper's CROMOSim Lite.
    None,
}

/// Settings of [`global_trajectory`].
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryOptions {
    /// Whether the root moves.
    pub trajectory: Trajectory,
    /// Metres per unit of depth maps and cameras.
    pub scale: ScaleSource,
    /// Which way is up.
    pub gravity: Gravity,
    /// Keypoints below it are not there, 0 to 1.
    pub least_confidence: f64,
    /// Standard deviation of a keypoint of confidence 1 in an image of 1080 rows, px; a factor on
    /// it is learnt.
    pub keypoint_std_px: f64,
    /// Standard deviation of a depth by itself from frame to frame: 0.02 is 2 %; a factor on it is
    /// learnt.
    pub depth_std: f64,
    /// Standard deviation of the slow error of a depth map's scale by itself, which no smoothing
    /// takes out: it is added to the covariance along the view.
    pub depth_scale_std: f64,
}

impl TrajectoryOptions {
    /// With this scale; up from the floor; keypoints from confidence 0.3 on, 5 px; depth 2 % from
    /// frame to frame, 5 % slowly.
    pub fn new(scale: ScaleSource) -> Self {
        Self {
            trajectory: Trajectory::Depth,
            scale,
            gravity: Gravity::Floor,
            least_confidence: 0.3,
            keypoint_std_px: 5.0,
            depth_std: 0.02,
            depth_scale_std: 0.05,
        }
    }
}

/// The root's track in the reconstruction's world, metres, step by step.
#[derive(Clone, Debug)]
pub struct RootTrack {
    /// What each frame says by itself.
    pub measured: Vec<Option<Measurement>>,
    /// Whether it was used.
    pub accepted: Vec<bool>,
    /// Knowing the past.
    pub filtered: Vec<RootState>,
    /// Knowing all frames.
    pub smoothed: Vec<RootState>,
}

/// A motion in the world, and where it comes from.
#[derive(Clone, Debug)]
pub struct GlobalTrajectory {
    /// World z up, floor at z = 0, the first camera's view along x, the first root at x = y = 0.
    /// Its confidence is [`confidence_of_std`] of the position's standard deviation per axis;
    /// `None` without a trajectory.
    pub motion: SmplMotion,
    /// Root position, velocity, acceleration and covariances in that world, one a frame; empty
    /// without a trajectory.
    pub states: Vec<RootState>,
    /// The steps before; `None` without a trajectory.
    pub track: Option<RootTrack>,
    /// The world from the reconstruction's, both in metres.
    pub world_from_source: Isometry3<f64>,
    /// In numbers.
    pub report: TrajectoryReport,
}

const LEAST_MEASUREMENTS: usize = 10;
/// Frames within this time err alike, s.
const SCALE_BLOCK_S: f64 = 1.0;

/// The motion in the world of a clip in camera axes, for `body` with the clip's average betas.
///
/// # Errors
/// [`CameraError::Length`] and [`CameraError::Value`] for a clip that contradicts itself,
/// [`CameraError::TooFewFrames`], [`CameraError::Scale`], [`CameraError::Gravity`], and those of
/// the depth maps and the body.
pub fn global_trajectory(
    clip: &CameraClip,
    depths: &mut dyn DepthProvider,
    body: &Arc<BodyModel>,
    options: &TrajectoryOptions,
) -> Result<GlobalTrajectory, CameraError> {
    clip.check()?;
    check_options(clip, options)?;
    let betas = average_betas(&clip.betas, &clip.pose_confidence);
    let shaped = ShapedBody::new(body.clone(), &betas)?;
    let none = || CameraError::TooFewFrames {
        name: clip.name.clone(),
        found: 0,
        frames: clip.poses.len(),
        needed: 1,
    };
    let placed = placed(clip).ok_or_else(none)?;
    let (scale, track, noise) = match options.trajectory {
        Trajectory::None => (None, None, None),
        Trajectory::Depth => {
            let (scale, measured) = measurements(clip, depths, &shaped, options)?;
            let dt = clip.rate_hz.recip();
            let (track, noise) = smooth_track(measured, dt, &roughly_up(options, &placed.cameras));
            (Some(scale), Some(track), Some(noise))
        }
    };
    let metres = scale.map_or(1.0, |scale| scale.metres_per_unit);
    let source = InSource {
        placed,
        metres,
        smoothed: track.as_ref().map(|track| track.smoothed.clone()),
    };
    let upright = stand_up(clip, &source, &shaped, options)?;
    let report = report(
        clip,
        options,
        (scale, noise, track.as_ref()),
        &upright,
        &source,
        betas.clone(),
    );
    let confidence = (!upright.states.is_empty()).then(|| {
        upright
            .states
            .iter()
            .map(|state| confidence_of_std(std_of(state)))
            .collect()
    });
    let motion = SmplMotion {
        name: clip.name.clone(),
        rate_hz: clip.rate_hz,
        gender: clip.gender,
        shape_space: body.shape_space(),
        betas,
        frames: continuous(upright.poses),
        confidence,
        report: None,
        poses: None,
        markers: None,
    };
    Ok(GlobalTrajectory {
        motion,
        states: upright.states,
        track,
        world_from_source: upright.world_from_source,
        report,
    })
}

fn check_options(clip: &CameraClip, options: &TrajectoryOptions) -> Result<(), CameraError> {
    let positive = |value: f64| value > 0.0 && value.is_finite();
    for (what, value) in [
        ("keypoint_std_px", options.keypoint_std_px),
        ("depth_std", options.depth_std),
    ] {
        if !positive(value) {
            return Err(clip.value(what.to_owned(), value, "a finite number above 0"));
        }
    }
    let size = match &options.scale {
        ScaleSource::Given(scale) => ("scale", *scale),
        ScaleSource::BodyHeight(height) => ("body height", *height),
        ScaleSource::Object(objects) => (
            "object length",
            objects
                .iter()
                .map(|object| object.length_m)
                .fold(1.0, f64::min),
        ),
    };
    if !positive(size.1) {
        return Err(clip.value(size.0.to_owned(), size.1, "a finite number above 0"));
    }
    for (what, value) in [
        ("least_confidence", options.least_confidence),
        ("depth_scale_std", options.depth_scale_std),
    ] {
        if !(0.0..1.0).contains(&value) {
            return Err(clip.value(what.to_owned(), value, "0 to below 1"));
        }
    }
    match options.gravity {
        Gravity::Given(up) if !(up.norm() > 1e-9 && up.norm().is_finite()) => {
            Err(CameraError::Gravity {
                name: clip.name.clone(),
                problem: format!("({}, {}, {}) is no direction", up.x, up.y, up.z),
            })
        }
        _ => Ok(()),
    }
}

/// The scale, and what each frame measures at that scale.
fn measurements(
    clip: &CameraClip,
    depths: &mut dyn DepthProvider,
    shaped: &ShapedBody,
    options: &TrajectoryOptions,
) -> Result<(ScaleEstimate, Vec<Option<Measurement>>), CameraError> {
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
    let mut of_objects = Vec::new();
    for frame in 0..clip.poses.len() {
        let map = depths.depth(frame)?;
        if let (ScaleSource::Object(objects), Some(map), Some(camera)) =
            (&options.scale, &map, &clip.cameras[frame])
        {
            let camera = camera.resized(clip.keypoint_image_px);
            let here = objects.iter().filter(|object| object.frame == frame);
            of_objects.extend(
                here.filter_map(|object| scale_of_object(object, map, &camera))
                    .map(|scale| (scale, 1.0)),
            );
        }
        observations.push(map.and_then(|map| observe(clip, frame, &map, &mut body, options)));
    }
    let found = observations.iter().flatten().count();
    if found < LEAST_MEASUREMENTS {
        let (name, frames) = (clip.name.clone(), clip.poses.len());
        return Err(CameraError::TooFewFrames {
            name,
            found,
            frames,
            needed: LEAST_MEASUREMENTS,
        });
    }
    let scale = scale(clip, &observations, &of_objects, options)?;
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

fn scale(
    clip: &CameraClip,
    observations: &[Option<RootObservation>],
    of_objects: &[(f64, f64)],
    options: &TrajectoryOptions,
) -> Result<ScaleEstimate, CameraError> {
    let problem = |problem: &str| CameraError::Scale {
        name: clip.name.clone(),
        problem: problem.to_owned(),
    };
    match &options.scale {
        ScaleSource::Given(metres_per_unit) => Ok(ScaleEstimate {
            metres_per_unit: *metres_per_unit,
            relative_std: 0.0,
            observations: 0,
        }),
        ScaleSource::Object(_) => combined_scale(of_objects, 1)
            .ok_or_else(|| problem("no depth is known at the ends of the known lengths")),
        ScaleSource::BodyHeight(_) => {
            let of_frame = |observation: &RootObservation, camera: &Option<Camera>| {
                let ray = camera
                    .as_ref()?
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
            let each = observations
                .iter()
                .zip(&clip.cameras)
                .filter_map(|(observation, camera)| of_frame(observation.as_ref()?, camera));
            let each: Vec<(f64, f64)> = each.collect();
            let block = (SCALE_BLOCK_S * clip.rate_hz).round().max(1.0) as usize;
            combined_scale(&each, block)
                .ok_or_else(|| problem("in no frame are six joints of the body seen"))
        }
    }
}

/// Up as far as it is known before the track: as given, or as the cameras are held on average.
fn roughly_up(options: &TrajectoryOptions, cameras: &[Camera]) -> Vector3<f64> {
    match options.gravity {
        Gravity::Given(up) => up,
        _ => mean_up(cameras),
    }
}

/// Learns the noise, filters, smooths, and decides once more about every frame from both sides: an
/// outlier at the start of a gap can fool the prediction, but not the smoothed track.
fn smooth_track(
    measured: Vec<Option<Measurement>>,
    dt: f64,
    up: &Vector3<f64>,
) -> (RootTrack, FilterNoise) {
    let noise = learn_noise(&measured, dt, up);
    let mut run = kalman_filter(&measured, dt, &noise, Gate::Mahalanobis);
    for _ in 0..2 {
        let smoothed = run.smoothed(dt);
        let near = |(measurement, state): (&Option<Measurement>, &RootState)| {
            let Some(measurement) = measurement else {
                return false;
            };
            let residual = measurement.position - state.position;
            let spread = noise.covariance(measurement) + state.position_covariance;
            spread
                .cholesky()
                .is_some_and(|factor| residual.dot(&factor.solve(&residual)) < GATE)
        };
        let accepted: Vec<bool> = measured.iter().zip(&smoothed).map(near).collect();
        if accepted == run.accepted {
            break;
        }
        run = kalman_filter(&measured, dt, &noise, Gate::Fixed(&accepted));
    }
    let (filtered, smoothed) = (run.filtered(), run.smoothed(dt));
    (
        RootTrack {
            measured,
            accepted: run.accepted,
            filtered,
            smoothed,
        },
        noise,
    )
}

fn std_of(state: &RootState) -> f64 {
    (state.position_covariance.trace() / 3.0).sqrt()
}

fn report(
    clip: &CameraClip,
    options: &TrajectoryOptions,
    (scale, noise, track): (
        Option<ScaleEstimate>,
        Option<FilterNoise>,
        Option<&RootTrack>,
    ),
    upright: &Upright,
    source: &InSource,
    betas: Vec<f64>,
) -> TrajectoryReport {
    let frames = clip.poses.len();
    let (mut left_out, mut gated) = (Vec::new(), Vec::new());
    let (mut gap, mut longest_gap) = (0_usize, 0);
    for (frame, accepted) in track
        .iter()
        .flat_map(|track| track.accepted.iter().enumerate())
    {
        let measured = track.is_some_and(|track| track.measured[frame].is_some());
        match (accepted, measured) {
            (true, _) => gap = 0,
            (false, true) => gated.push(frame),
            (false, false) => left_out.push(frame),
        }
        gap += usize::from(!accepted);
        longest_gap = longest_gap.max(gap);
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let used = if options.trajectory == Trajectory::None {
        0
    } else {
        frames - left_out.len() - gated.len()
    };
    TrajectoryReport {
        frames,
        used,
        left_out,
        gated,
        longest_gap_s: longest_gap as f64 / clip.rate_hz,
        poses_bridged: source.placed.poses_bridged,
        cameras_bridged: source.placed.cameras_bridged,
        scale,
        noise,
        position_std_m: median(upright.states.iter().map(std_of).collect()),
        velocity_std: median(
            upright
                .states
                .iter()
                .map(|state| (state.velocity_covariance.trace() / 3.0).sqrt())
                .collect(),
        ),
        up_in_source: upright.up_in_source.into(),
        floor_rms_m: upright.floor_rms_m,
        betas,
    }
}
