//! Readings as IMUSim computes them.

use cromosim_imu::{KinematicSample, SensorTrajectory};
use cromosim_spatial::{PoseSmoothing, PoseSpline, Smoothing, Stamp};
use nalgebra::Isometry3;

use crate::EvaluationError;

/// IMUSim takes positions for good to 1 mm and quaternion components for good to 0.001 (its
/// defaults `positionStdDev`, `rotationStdDev`).
const IMUSIM_STD: f64 = 0.001;

/// Smoothing splines that stay within 1 mm and 0.001 of the frames, root mean square.
pub(super) fn imusim(
    trajectory: &SensorTrajectory,
    stamps: &[Stamp],
) -> Result<Vec<KinematicSample>, EvaluationError> {
    let smoothing = PoseSmoothing {
        position: Smoothing::ResidualStd(IMUSIM_STD),
        rotation: Smoothing::ResidualStd(IMUSIM_STD),
    };
    let frames = trajectory.frames();
    let at: Vec<Stamp> = frames.iter().map(|frame| frame.stamp).collect();
    let poses: Vec<Isometry3<f64>> = frames.iter().map(|frame| frame.world_from_sensor).collect();
    let spline = PoseSpline::fit(&at, &poses, smoothing)?;
    let sample = |stamp: &Stamp| {
        let motion = spline.evaluate(*stamp);
        KinematicSample {
            stamp: *stamp,
            world_from_sensor: Isometry3::from_parts(motion.position.into(), motion.rotation),
            acceleration_in_world: motion.acceleration,
            angular_velocity_in_world: motion.angular_velocity,
            angular_acceleration_in_world: Some(motion.angular_acceleration),
            variance: Default::default(),
            bandwidth: None,
        }
    };
    Ok(stamps.iter().map(sample).collect())
}
