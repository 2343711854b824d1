//! Smoothing quintic splines of position and quaternion, see [`cromosim_spatial::PoseSpline`].

use cromosim_spatial::{
    Influence, Located, MotionEstimate, PoseSmoothing, PoseSource, PoseSpline, PoseTimes,
    PosesInTime, Stamp,
};
use nalgebra::Isometry3;

use crate::uncertainty::{FrameWeights, any_error};
use crate::{ImuError, KinematicSample, SampleVariance, SensorFrame, SensorTrajectory};

/// The spline of a series of frames.
pub(crate) fn fit(
    times: &PoseTimes,
    frames: &[SensorFrame],
    smoothing: PoseSmoothing,
) -> Result<PoseSpline, ImuError> {
    Ok(PoseSpline::fit_on(times, &poses(frames), smoothing)?)
}

/// Those of several, each as if it were alone.
pub(crate) fn fit_all(
    times: &PoseTimes,
    trajectories: &[SensorTrajectory],
    smoothing: PoseSmoothing,
) -> Result<Vec<PoseSpline>, ImuError> {
    Ok(PoseSpline::fit_all_on(times, trajectories, smoothing)?)
}

impl PosesInTime for SensorTrajectory {
    fn count(&self) -> usize {
        self.frames().len()
    }

    fn pose(&self, number: usize) -> &Isometry3<f64> {
        &self.frames()[number].world_from_sensor
    }
}

fn poses(frames: &[SensorFrame]) -> Vec<Isometry3<f64>> {
    frames.iter().map(|frame| frame.world_from_sensor).collect()
}

/// The motion at a stamp that lies there, and how far it may be off where the spline has learnt that: by the noise that it
/// has learnt, by the motion beyond it and by what poses of this source hide; or by what is known otherwise, where that is more.
#[inline]
pub(crate) fn sample(
    spline: &PoseSpline,
    source: PoseSource,
    (stamp, located): (Stamp, &Located),
    known: Option<SampleVariance>,
) -> KinematicSample {
    let MotionEstimate {
        motion,
        variance,
        bandwidth,
        jitter,
    } = spline.estimate_at(located);
    KinematicSample {
        stamp,
        world_from_sensor: Isometry3::from_parts(motion.position.into(), motion.rotation),
        acceleration_in_world: motion.acceleration,
        angular_velocity_in_world: motion.angular_velocity,
        angular_acceleration_in_world: Some(motion.angular_acceleration),
        variance: variance
            .zip(jitter)
            .map(|(learnt, jitter)| learnt.plus(source.unseen_errors(&bandwidth, &jitter)))
            .unwrap_or_default()
            .larger(known.unwrap_or_default()),
        bandwidth: Some(bandwidth),
    }
}

/// What errors of a spline's frames leave in its samples, its smoothing taken as given. That the
/// smoothing is chosen from the same frames adds to it: 12 % of the acceleration's variance and 28
/// % of the angular velocity's on the tests' jittered second at 100 Hz.
pub(crate) struct SplineVariance<'a> {
    frames: &'a [SensorFrame],
    position: Influence,
    rotation: Influence,
}

impl<'a> SplineVariance<'a> {
    /// For a spline through or near `frames`; `None` where no errors are known of.
    pub(crate) fn new(
        times: &PoseTimes,
        spline: &PoseSpline,
        frames: &'a [SensorFrame],
    ) -> Result<Option<Self>, ImuError> {
        if !any_error(frames) {
            return Ok(None);
        }
        let influence = |weight| Influence::new(times.system(), weight);
        let (position, rotation) = (
            influence(spline.position().weight())?,
            influence(spline.rotation().weight())?,
        );
        Ok(Some(Self {
            frames,
            position,
            rotation,
        }))
    }

    /// At a stamp within the frames.
    pub(crate) fn at(&self, stamp: Stamp) -> SampleVariance {
        let seconds = stamp - self.frames[0].stamp;
        FrameWeights::by_spline(&self.position, &self.rotation, seconds).variance(self.frames)
    }
}
