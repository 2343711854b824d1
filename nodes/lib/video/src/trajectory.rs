//! The steps in order: from a camera's clip to a motion in the world.

use std::sync::Arc;

use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{SmplMotion, continuous};
use cromosim_spatial::confidence_of_std;
use nalgebra::{Isometry3, Vector3};

use crate::clip::{CameraClip, DepthProvider, average_betas};
use crate::error::VideoError;
use crate::filter::{FilterNoise, GATE, Gate, Measurement, RootState, kalman_filter};
use crate::learn::learn_noise;
use crate::measurements::measure_frames;
use crate::options::{Trajectory, TrajectoryOptions};
use crate::report::TrajectoryReport;
use crate::scale::ScaleEstimate;
use crate::source_poses::source_poses;
use crate::stand::{SourceMotion, Upright, mean_up, stand_up};

/// The root's track in the reconstruction's world, metres, step by step.
#[derive(Clone, Debug)]
pub struct RootTrack {
    /// What each frame says by itself.
    pub measured: Vec<Option<Measurement>>,
    /// Whether the filter used the frame's measurement.
    pub accepted: Vec<bool>,
    /// The filter's states, each from the frames up to it.
    pub filtered: Vec<RootState>,
    /// The smoother's states, each from all frames.
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
    /// The track that the states come from; `None` without a trajectory.
    pub track: Option<RootTrack>,
    /// From the reconstruction's world (scaled to metres) into the motion's.
    pub world_from_source: Isometry3<f64>,
    /// What was used, left out and found.
    pub report: TrajectoryReport,
}

/// The motion in the world of a clip in camera axes, for `body` with the clip's average betas.
///
/// # Errors
/// [`VideoError::Length`] and [`VideoError::Value`] for a clip that contradicts itself,
/// [`VideoError::TooFewFrames`], [`VideoError::Scale`], [`VideoError::Gravity`], and those of
/// the depth maps and the body.
pub fn global_trajectory(
    clip: &CameraClip,
    depths: &mut dyn DepthProvider,
    body: &Arc<BodyModel>,
    options: &TrajectoryOptions,
) -> Result<GlobalTrajectory, VideoError> {
    clip.check()?;
    options.check(clip)?;
    let betas = average_betas(&clip.betas, &clip.pose_confidence);
    let shaped = ShapedBody::new(body.clone(), &betas)?;
    let none = || VideoError::TooFewFrames {
        name: clip.name.clone(),
        found: 0,
        frames: clip.poses.len(),
        needed: 1,
    };
    let poses = source_poses(clip).ok_or_else(none)?;
    let depth_track = match options.trajectory {
        Trajectory::None => None,
        Trajectory::Depth => {
            let (scale, measured) = measure_frames(clip, depths, &shaped, options)?;
            // All that is known of up before the track.
            let up = mean_up(&poses.cameras);
            Some(DepthTrack::new(scale, measured, clip.rate_hz.recip(), &up))
        }
    };
    let source = SourceMotion {
        poses,
        metres_per_unit: depth_track
            .as_ref()
            .map_or(1.0, |track| track.scale.metres_per_unit),
        smoothed: depth_track
            .as_ref()
            .map(|track| track.root.smoothed.clone()),
    };
    let upright = stand_up(clip, &source, &shaped, options)?;
    let report = report(clip, depth_track.as_ref(), &upright, &source, &betas);
    let motion = SmplMotion {
        name: clip.name.clone(),
        rate_hz: clip.rate_hz,
        gender: clip.gender,
        shape_space: body.shape_space(),
        betas,
        frames: continuous(upright.poses),
        confidence: confidence(&upright.states),
        report: None,
        poses: None,
        markers: None,
    };
    Ok(GlobalTrajectory {
        motion,
        states: upright.states,
        track: depth_track.map(|track| track.root),
        world_from_source: upright.world_from_source,
        report,
    })
}

/// The root's track by depth maps, with the scale and the noise that it was found with.
struct DepthTrack {
    scale: ScaleEstimate,
    noise: FilterNoise,
    root: RootTrack,
}

impl DepthTrack {
    /// Learns the noise, filters, smooths, and decides once more about every frame from both sides:
    /// an outlier at the start of a gap can fool the prediction, but not the smoothed track. `dt`
    /// is the time between frames, s.
    fn new(
        scale: ScaleEstimate,
        measured: Vec<Option<Measurement>>,
        dt: f64,
        up: &Vector3<f64>,
    ) -> Self {
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
        Self {
            scale,
            noise,
            root: RootTrack {
                measured,
                accepted: run.accepted,
                filtered,
                smoothed,
            },
        }
    }
}

/// Standard deviation of the position per axis, m.
fn position_std(state: &RootState) -> f64 {
    (state.position_covariance.trace() / 3.0).sqrt()
}

/// One value a frame in [0, 1]; `None` without a trajectory.
fn confidence(states: &[RootState]) -> Option<Vec<f64>> {
    let of_state = |state| confidence_of_std(position_std(state));
    (!states.is_empty()).then(|| states.iter().map(of_state).collect())
}

/// Standard deviation of the velocity per axis, m/s.
fn velocity_std(state: &RootState) -> f64 {
    (state.velocity_covariance.trace() / 3.0).sqrt()
}

/// Which frames made the track.
#[derive(Default)]
struct FrameUse {
    used: usize,
    left_out: Vec<usize>,
    gated: Vec<usize>,
    longest_gap: usize,
}

impl FrameUse {
    fn in_track(track: &RootTrack) -> Self {
        let mut frames = Self::default();
        let mut gap = 0;
        for (frame, accepted) in track.accepted.iter().enumerate() {
            match (accepted, track.measured[frame].is_some()) {
                (true, _) => frames.used += 1,
                (false, true) => frames.gated.push(frame),
                (false, false) => frames.left_out.push(frame),
            }
            gap = if *accepted { 0 } else { gap + 1 };
            frames.longest_gap = frames.longest_gap.max(gap);
        }
        frames
    }
}

fn report(
    clip: &CameraClip,
    depth_track: Option<&DepthTrack>,
    upright: &Upright,
    source: &SourceMotion,
    betas: &[f64],
) -> TrajectoryReport {
    let frames =
        depth_track.map_or_else(FrameUse::default, |track| FrameUse::in_track(&track.root));
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    TrajectoryReport {
        frames: clip.poses.len(),
        used: frames.used,
        left_out: frames.left_out,
        gated: frames.gated,
        longest_gap_s: frames.longest_gap as f64 / clip.rate_hz,
        poses_bridged: source.poses.poses_bridged,
        cameras_bridged: source.poses.cameras_bridged,
        scale: depth_track.map(|track| track.scale),
        noise: depth_track.map(|track| track.noise),
        position_std_m: median(upright.states.iter().map(position_std).collect()),
        velocity_std: median(upright.states.iter().map(velocity_std).collect()),
        up_in_source: upright.up_in_source.into(),
        floor_rms_m: upright.floor_rms_m,
        betas: betas.to_vec(),
    }
}
