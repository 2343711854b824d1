//! Whole trajectories at once.

use std::fmt;

use cromosim_spatial::{
    Located, PoseSmoothing, PoseSource, PoseSpline, PoseTimes, Stamp, derivative_weights, so3,
};
use nalgebra::{Isometry3, Vector3};

use crate::low_pass_error;
use crate::schemes::StencilScheme;
use crate::schemes::spline::{self, SplineVariance};
use crate::uncertainty::{FrameWeights, any_error};
use crate::{
    ImuError, ImuSample, KinematicSample, SampleVariance, Scheme, SensorFrame, SensorTrajectory,
};

/// The error-free readings at `output` stamps, in any order. Stamps before the first or after the
/// last frame read what the end reads.
///
/// The spline is evaluated at the stamps. The other schemes exist at the frames alone; in between a
/// cubic through the four nearest frames is taken of acceleration, angular velocity, position and
/// the rotation vector since the frame before (errors O(h^4)). At a frame's own stamp its estimate
/// comes out unchanged.
///
/// # Errors
/// [`ImuError::Trajectory`] where the spline's equations cannot be solved.
pub fn simulate(
    trajectory: &SensorTrajectory,
    scheme: Scheme,
    output: &[Stamp],
) -> Result<Vec<ImuSample>, ImuError> {
    Ok(simulate_kinematics(trajectory, scheme, output)?
        .iter()
        .map(KinematicSample::imu)
        .collect())
}

/// As [`simulate`], in world axes and with the position.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_kinematics(
    trajectory: &SensorTrajectory,
    differentiation: impl Into<Differentiation>,
    output: &[Stamp],
) -> Result<Vec<KinematicSample>, ImuError> {
    let stamps: Vec<_> = trajectory
        .frames()
        .iter()
        .map(|frame| frame.stamp)
        .collect();
    simulate_kinematics_on(
        &PoseTimes::new(&stamps)?,
        trajectory,
        differentiation,
        output,
    )
}

/// How motions are differentiated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Differentiation {
    /// By a scheme.
    Scheme(Scheme),
    /// By a spline that passes what is below this frequency, Hz, whatever the motion: of zero phase,
    /// with the response `1 / (1 + (f / bandwidth)^10)`.
    Bandwidth(f64),
}

impl fmt::Display for Differentiation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scheme(scheme) => scheme.fmt(formatter),
            Self::Bandwidth(hz) => write!(formatter, "bandwidth {hz} Hz"),
        }
    }
}

impl From<Scheme> for Differentiation {
    fn from(scheme: Scheme) -> Self {
        Self::Scheme(scheme)
    }
}

/// As [`simulate_kinematics`], with the spline equations of the trajectory's stamps, which all
/// placements of a clip can share.
///
/// # Errors
/// As [`simulate`], also where `times` has another number of stamps than the trajectory has frames;
/// [`ImuError::Bandwidth`] for one that the frames do not resolve.
pub fn simulate_kinematics_on(
    times: &PoseTimes,
    trajectory: &SensorTrajectory,
    differentiation: impl Into<Differentiation>,
    output: &[Stamp],
) -> Result<Vec<KinematicSample>, ImuError> {
    let bandwidth_hz = match differentiation.into() {
        Differentiation::Bandwidth(bandwidth_hz) => bandwidth_hz,
        Differentiation::Scheme(scheme) => {
            return match scheme.stencil() {
                Some(stencil) => Ok(by_differences(trajectory, stencil, output)),
                None => {
                    let smoothing = scheme.smoothing(trajectory.source());
                    by_spline(times, trajectory, smoothing, output)
                }
            };
        }
    };
    let highest_hz = 0.5 / times.system().interval();
    if !(bandwidth_hz > 0.0 && bandwidth_hz <= highest_hz) {
        return Err(ImuError::Bandwidth {
            bandwidth_hz,
            highest_hz,
        });
    }
    let smoothing = PoseSmoothing::cutoff_hz(bandwidth_hz);
    let mut samples = by_spline(times, trajectory, smoothing, output)?;
    low_pass_error::state(times, trajectory, bandwidth_hz, &mut samples)?;
    Ok(samples)
}

/// As [`simulate_kinematics_on`] of several trajectories, each to its own stamps: the same samples, but
/// splines that follow the motion are fitted at once where the trajectories come from one source.
///
/// # Errors
/// As [`simulate_kinematics_on`], of the first that it is due to.
pub fn simulate_several_on(
    times: &PoseTimes,
    trajectories: &[SensorTrajectory],
    scheme: Scheme,
    outputs: &[Vec<Stamp>],
) -> Result<Vec<Vec<KinematicSample>>, ImuError> {
    let source = trajectories.first().map(SensorTrajectory::source);
    let together = trajectories.iter().all(|one| Some(one.source()) == source);
    if scheme == Scheme::AdaptiveSpline && together {
        let smoothing = scheme.smoothing(source.unwrap_or_default());
        // Where one cannot be fitted, each alone says which.
        if let Ok(fitted) = spline::fit_all(times, trajectories, smoothing) {
            return of_splines(times, trajectories, &fitted, outputs);
        }
    }
    let several = trajectories.iter().zip(outputs);
    several
        .map(|(one, output)| simulate_kinematics_on(times, one, scheme, output))
        .collect()
}

fn by_spline(
    times: &PoseTimes,
    trajectory: &SensorTrajectory,
    smoothing: PoseSmoothing,
    output: &[Stamp],
) -> Result<Vec<KinematicSample>, ImuError> {
    let fitted = spline::fit(times, trajectory.frames(), smoothing)?;
    of_spline(times, trajectory, &fitted, output)
}

/// Samples of each spline to its own stamps. Where these are the same, each is located once.
fn of_splines(
    times: &PoseTimes,
    trajectories: &[SensorTrajectory],
    fitted: &[PoseSpline],
    outputs: &[Vec<Stamp>],
) -> Result<Vec<Vec<KinematicSample>>, ImuError> {
    let span = |one: &SensorTrajectory| (one.start(), one.end());
    let same_span = trajectories
        .array_windows()
        .all(|[a, b]| span(a) == span(b));
    let same = same_span && outputs.array_windows().all(|[a, b]| a == b);
    let several = trajectories.iter().zip(fitted).zip(outputs);
    let (true, Some(output)) = (same, outputs.first()) else {
        return several
            .map(|((one, fitted), output)| of_spline(times, one, fitted, output))
            .collect();
    };
    let samplers = several.map(|((one, fitted), _)| Sampler::new(times, one, fitted));
    let samplers = samplers.collect::<Result<Vec<_>, _>>()?;
    let room = || Vec::with_capacity(output.len());
    let mut samples: Vec<_> = samplers.iter().map(|_| room()).collect();
    for &stamp in output {
        let held = stamp.clamp(trajectories[0].start(), trajectories[0].end());
        let located = times.locate(held);
        for (sampler, samples) in samplers.iter().zip(&mut samples) {
            samples.push(sampler.sample(stamp, (held, &located)));
        }
    }
    Ok(samples)
}

fn of_spline(
    times: &PoseTimes,
    trajectory: &SensorTrajectory,
    fitted: &PoseSpline,
    output: &[Stamp],
) -> Result<Vec<KinematicSample>, ImuError> {
    let sampler = Sampler::new(times, trajectory, fitted)?;
    let sample = |&stamp: &Stamp| {
        let held = stamp.clamp(trajectory.start(), trajectory.end());
        sampler.sample(stamp, (held, &times.locate(held)))
    };
    Ok(output.iter().map(sample).collect())
}

/// A spline with what is known about its frames.
struct Sampler<'a> {
    fitted: &'a PoseSpline,
    source: PoseSource,
    /// What errors of the frames leave, where any are known of.
    errors: Option<SplineVariance<'a>>,
}

impl<'a> Sampler<'a> {
    fn new(
        times: &PoseTimes,
        trajectory: &'a SensorTrajectory,
        fitted: &'a PoseSpline,
    ) -> Result<Self, ImuError> {
        Ok(Self {
            fitted,
            source: trajectory.source(),
            errors: SplineVariance::new(times, fitted, trajectory.frames())?,
        })
    }

    /// What is read at a stamp; it is held within the frames, and lies there.
    #[inline]
    fn sample(&self, stamp: Stamp, (held, located): (Stamp, &Located)) -> KinematicSample {
        let known = self.errors.as_ref().map(|errors| errors.at(held));
        spline::sample(self.fitted, self.source, (stamp, located), known)
    }
}

fn by_differences(
    trajectory: &SensorTrajectory,
    scheme: StencilScheme,
    output: &[Stamp],
) -> Vec<KinematicSample> {
    let frames = trajectory.frames();
    let at_frames: Vec<_> = (0..frames.len())
        .map(|k| at_frame(scheme, frames, k))
        .collect();
    let sample = |&stamp: &Stamp| {
        let held = stamp.clamp(trajectory.start(), trajectory.end());
        KinematicSample {
            stamp,
            variance: stencil_variance(scheme, frames, held),
            ..between_frames(&at_frames, held)
        }
    };
    output.iter().map(sample).collect()
}

/// What errors of the frames leave in a stencil's sample.
pub(crate) fn stencil_variance(
    scheme: StencilScheme,
    frames: &[SensorFrame],
    stamp: Stamp,
) -> SampleVariance {
    // A sample rests on the frames within two estimates and their reach.
    let after = frames.partition_point(|frame| frame.stamp < stamp);
    let near = &frames[after.saturating_sub(8)..(after + 8).min(frames.len())];
    if any_error(near) {
        FrameWeights::by_stencil(scheme, frames, stamp).variance(frames)
    } else {
        SampleVariance::default()
    }
}

/// A scheme's estimate at a frame.
pub(crate) fn at_frame(scheme: StencilScheme, frames: &[SensorFrame], k: usize) -> KinematicSample {
    let (acceleration, angular_velocity) = scheme.at_frame(frames, k);
    KinematicSample {
        stamp: frames[k].stamp,
        world_from_sensor: frames[k].world_from_sensor,
        acceleration_in_world: acceleration,
        angular_velocity_in_world: angular_velocity,
        angular_acceleration_in_world: None,
        variance: SampleVariance::default(),
        bandwidth: None,
    }
}

/// Cubic interpolation of estimates at frames; `stamp` lies within them.
pub(crate) fn between_frames(at_frames: &[KinematicSample], stamp: Stamp) -> KinematicSample {
    let after = at_frames
        .partition_point(|sample| sample.stamp < stamp)
        .min(at_frames.len() - 1);
    if at_frames[after].stamp == stamp {
        return at_frames[after];
    }
    let width = at_frames.len().min(4);
    let start = after.saturating_sub(2).min(at_frames.len() - width);
    let around = &at_frames[start..start + width];
    let mut seconds = [0.0; 4];
    for (seconds, sample) in seconds.iter_mut().zip(around) {
        *seconds = sample.stamp - stamp;
    }
    let weights = derivative_weights(&seconds[..width], 0.0)[0];
    let sum = |of: &dyn Fn(&KinematicSample) -> Vector3<f64>| -> Vector3<f64> {
        around
            .iter()
            .zip(weights)
            .map(|(sample, weight)| of(sample) * weight)
            .sum()
    };
    let before = at_frames[after.saturating_sub(1)].world_from_sensor;
    let turn =
        sum(&|sample| so3::log(&(sample.world_from_sensor.rotation * before.rotation.inverse())));
    let step =
        sum(&|sample| sample.world_from_sensor.translation.vector - before.translation.vector);
    KinematicSample {
        stamp,
        world_from_sensor: Isometry3::from_parts(
            (before.translation.vector + step).into(),
            so3::exp(&turn) * before.rotation,
        ),
        acceleration_in_world: sum(&|sample| sample.acceleration_in_world),
        angular_velocity_in_world: sum(&|sample| sample.angular_velocity_in_world),
        angular_acceleration_in_world: None,
        variance: SampleVariance::default(),
        bandwidth: None,
    }
}

#[cfg(test)]
#[path = "simulate_tests.rs"]
mod tests;
