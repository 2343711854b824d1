//! Smoothing quintic splines of position and quaternion, see [`cromosim_spatial::PoseSpline`].

use cromosim_spatial::{PoseSmoothing, PoseSpline, PoseTimes, Stamp};
use nalgebra::Isometry3;

use crate::{ImuError, KinematicSample, SensorFrame};

/// The spline of a series of frames, smoothed as the frames themselves ask for.
pub(crate) fn fit(times: &PoseTimes, frames: &[SensorFrame]) -> Result<PoseSpline, ImuError> {
    let world_from_sensor: Vec<Isometry3<f64>> = frames.iter().map(|frame| frame.world_from_sensor).collect();
    Ok(PoseSpline::fit_on(times, &world_from_sensor, PoseSmoothing::default())?)
}

/// The motion at a stamp.
pub(crate) fn sample(spline: &PoseSpline, stamp: Stamp) -> KinematicSample {
    let motion = spline.evaluate(stamp);
    KinematicSample {
        stamp,
        world_from_sensor: Isometry3::from_parts(motion.position.into(), motion.rotation),
        acceleration: motion.acceleration,
        angular_velocity: motion.angular_velocity,
        angular_acceleration: Some(motion.angular_acceleration),
    }
}
