//! What a network is told of a motion.

use cromosim_body::{BodyPose, ShapedBody};
use cromosim_imu::{
    KinematicSample, MountedSensor, Placement, Scheme, SensorTrajectory, simulate_kinematics,
};
use cromosim_spatial::{MAX_STENCIL, Stamp, derivative_weights, so3, uniform_stamps};
use nalgebra::{Isometry3, Vector3};

use crate::{LearnedError, PATCH_POINTS, Patch};

/// Samples per second of every network, Hz.
pub const NETWORK_RATE_HZ: f64 = 100.0;

/// A patch of skin over time, with the analytic kinematics of the sensor on it; sample k stands at
/// `start + k / NETWORK_RATE_HZ`.
#[derive(Clone, Debug)]
pub struct SiteMotion {
    /// The nine points, m, world.
    pub points: Vec<[Vector3<f64>; PATCH_POINTS]>,
    /// The sensor's frame and its analytic derivatives, world axes; as many as points.
    pub kinematics: Vec<KinematicSample>,
    /// Acceleration, m/s2, and angular velocity, rad/s, by plain differences of the frames at
    /// neighbouring samples, world axes: noisy, but little is smoothed away. As many as points.
    pub unsmoothed: Vec<[Vector3<f64>; 2]>,
}

impl SiteMotion {
    /// A placement on a body that moves: frames in between are found by cubics through the four
    /// around.
    ///
    /// # Errors
    /// [`LearnedError::Imu`] for fewer than two frames or times that go backwards,
    /// [`LearnedError::NoPatch`].
    pub fn on_body(
        body: &ShapedBody,
        placement: &Placement,
        stamps: &[Stamp],
        poses: &[BodyPose],
    ) -> Result<Self, LearnedError> {
        let mounted = MountedSensor::new(body, placement)?;
        let trajectory = mounted.trajectory(stamps, poses)?;
        let patch = Patch::new(body, mounted.site())?;
        let frames: Vec<_> = poses.iter().map(|pose| patch.points(pose)).collect();
        Self::new(&trajectory, placement.scheme(), &frames)
    }

    /// A sensor on a rigid body; a flat patch in its xy plane stands for the skin.
    ///
    /// # Errors
    /// [`LearnedError::Imu`] where the scheme cannot differentiate it.
    pub fn rigid(trajectory: &SensorTrajectory, scheme: Scheme) -> Result<Self, LearnedError> {
        let frames: Vec<_> = trajectory
            .frames()
            .iter()
            .map(|frame| Patch::rigid(&frame.world_from_sensor))
            .collect();
        Self::new(trajectory, scheme, &frames)
    }

    /// A sensor's trajectory with the patch's points at each of its frames.
    ///
    /// # Errors
    /// [`LearnedError::Imu`] where the scheme cannot differentiate it, [`LearnedError::TooFew`] for
    /// another number of points than frames.
    pub fn new(
        trajectory: &SensorTrajectory,
        scheme: Scheme,
        frames: &[[Vector3<f64>; PATCH_POINTS]],
    ) -> Result<Self, LearnedError> {
        let (found, needed) = (frames.len(), trajectory.frames().len());
        if found != needed {
            return Err(LearnedError::TooFew {
                what: "points of a patch".to_owned(),
                found,
                needed,
            });
        }
        let grid = uniform_stamps(trajectory.start(), trajectory.end(), NETWORK_RATE_HZ)?;
        let stamps: Vec<Stamp> = trajectory
            .frames()
            .iter()
            .map(|frame| frame.stamp)
            .collect();
        let points = grid
            .iter()
            .map(|stamp| Around::new(&stamps, *stamp).blend(|frame| &frames[frame]))
            .collect();
        let poses: Vec<_> = trajectory
            .frames()
            .iter()
            .map(|frame| frame.world_from_sensor)
            .collect();
        let at_samples: Vec<_> = grid
            .iter()
            .map(|stamp| Around::new(&stamps, *stamp).blend_pose(|frame| &poses[frame]))
            .collect();
        let unsmoothed = differences(&at_samples);
        Ok(Self {
            points,
            kinematics: simulate_kinematics(trajectory, scheme, &grid)?,
            unsmoothed,
        })
    }

    /// Samples.
    pub fn len(&self) -> usize {
        self.kinematics.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.kinematics.is_empty()
    }
}

/// At each sample; at the ends that of the sample beside.
fn differences(samples: &[Isometry3<f64>]) -> Vec<[Vector3<f64>; 2]> {
    let last = samples.len().saturating_sub(1);
    let at = |k: usize| {
        let three = k
            .checked_sub(1)
            .and_then(|first| samples.get(first..first + 3))
            .and_then(|three| three.as_array());
        three.map_or([Vector3::zeros(); 2], difference)
    };
    (0..samples.len())
        .map(|k| at(k.clamp(1, last.saturating_sub(1).max(1))))
        .collect()
}

/// Second difference of the position, m/s2, and the turn between the neighbours, rad/s, at the
/// middle of three samples. The rate of the samples, not that of the source, so that scatter of the
/// same size looks alike.
pub(crate) fn difference([before, own, after]: &[Isometry3<f64>; 3]) -> [Vector3<f64>; 2] {
    let second =
        before.translation.vector - 2.0 * own.translation.vector + after.translation.vector;
    let turn = so3::log(&(after.rotation * before.rotation.inverse()));
    [
        second * NETWORK_RATE_HZ.powi(2),
        turn * (0.5 * NETWORK_RATE_HZ),
    ]
}

/// How the frames around a stamp make up what was there: a cubic through four, or one frame of that
/// very stamp.
#[derive(Clone, Copy)]
pub(crate) struct Around {
    first: usize,
    width: usize,
    weights: [f64; MAX_STENCIL],
    /// The last frame before the stamp.
    before: usize,
}

impl Around {
    /// Frames at these stamps (at least one, in order).
    pub(crate) fn new(stamps: &[Stamp], stamp: Stamp) -> Self {
        let after = stamps
            .partition_point(|other| *other < stamp)
            .min(stamps.len() - 1);
        if stamps[after] == stamp {
            return Self {
                first: after,
                width: 1,
                weights: [1.0; MAX_STENCIL],
                before: after,
            };
        }
        let width = stamps.len().min(4);
        let first = after.saturating_sub(2).min(stamps.len() - width);
        let mut seconds = [0.0; 4];
        for (seconds, other) in seconds.iter_mut().zip(&stamps[first..first + width]) {
            *seconds = *other - stamp;
        }
        Self {
            first,
            width,
            weights: derivative_weights(&seconds[..width], 0.0)[0],
            before: after.saturating_sub(1),
        }
    }

    /// The points there, from those of each frame.
    pub(crate) fn blend<'a>(
        &self,
        frame: impl Fn(usize) -> &'a [Vector3<f64>; PATCH_POINTS],
    ) -> [Vector3<f64>; PATCH_POINTS] {
        if self.width == 1 {
            return *frame(self.first);
        }
        std::array::from_fn(|point| {
            (0..self.width)
                .map(|k| frame(self.first + k)[point] * self.weights[k])
                .sum()
        })
    }

    /// The pose there, from that of each frame: position and rotation vector since the frame
    /// before.
    pub(crate) fn blend_pose<'a>(
        &self,
        frame: impl Fn(usize) -> &'a Isometry3<f64>,
    ) -> Isometry3<f64> {
        let before = *frame(self.before);
        if self.width == 1 {
            return before;
        }
        let sum = |of: &dyn Fn(&Isometry3<f64>) -> Vector3<f64>| -> Vector3<f64> {
            (0..self.width)
                .map(|k| of(frame(self.first + k)) * self.weights[k])
                .sum()
        };
        let turn = sum(&|frame| so3::log(&(frame.rotation * before.rotation.inverse())));
        let step = sum(&|frame| frame.translation.vector - before.translation.vector);
        Isometry3::from_parts(
            (before.translation.vector + step).into(),
            so3::exp(&turn) * before.rotation,
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_body::BodyModel;
    use cromosim_imu::{PlacementSet, SensorFrame};

    use super::*;

    #[test]
    fn differences_are_those_of_a_steady_turn_and_fall() {
        let frame = |k: u32| {
            let seconds = f64::from(k) / 60.0;
            let at = Isometry3::new(
                Vector3::new(0.0, 1.0, -4.9 * seconds * seconds),
                Vector3::new(0.0, 2.0 * seconds, 0.0),
            );
            SensorFrame::new(Stamp::from_seconds(seconds), at)
        };
        let trajectory = SensorTrajectory::new((0..60).map(frame).collect()).unwrap();
        let motion = SiteMotion::rigid(&trajectory, Scheme::Richardson).unwrap();
        assert_eq!(motion.unsmoothed.len(), motion.len());
        for [acceleration, angular_velocity] in motion.unsmoothed {
            let (fall, turn) = (Vector3::new(0.0, 0.0, -9.8), Vector3::new(0.0, 2.0, 0.0));
            // Stamps are whole nanoseconds, which second differences multiply by 1e4.
            assert!((acceleration - fall).norm() < 1e-3 && (angular_velocity - turn).norm() < 1e-5);
        }
        assert_eq!(
            differences(&[Isometry3::identity(); 2]),
            [[Vector3::zeros(); 2]; 2]
        );
    }

    #[test]
    fn a_motion_between_frames_is_cubic() {
        let at = |seconds: f64| Vector3::new(seconds.powi(3), 1.0 - seconds, seconds * seconds);
        let frame = |k: u32| {
            let seconds = f64::from(k) / 37.0;
            SensorFrame::new(
                Stamp::from_seconds(seconds),
                Isometry3::new(at(seconds), Vector3::zeros()),
            )
        };
        let trajectory = SensorTrajectory::new((0..38).map(frame).collect()).unwrap();
        let motion = SiteMotion::rigid(&trajectory, Scheme::Richardson).unwrap();
        assert_eq!(motion.len(), 101);
        let origin = Patch::rigid(&Isometry3::identity());
        for (k, points) in motion.points.iter().enumerate() {
            for (point, rest) in points.iter().zip(&origin) {
                assert!(
                    (point - rest - at(k as f64 / 100.0)).norm() < 1e-9,
                    "sample {k}"
                );
            }
        }
    }

    #[test]
    fn the_patch_surrounds_the_sensor_on_a_body() {
        let body = ShapedBody::new(BodyModel::embedded(), &[]).unwrap();
        let placements = PlacementSet::demo();
        let stamps =
            uniform_stamps(Stamp::from_seconds(0.0), Stamp::from_seconds(0.5), 120.0).unwrap();
        let poses = vec![BodyPose::rest(Vector3::new(0.0, 0.0, 1.0)); stamps.len()];
        for placement in placements.placements() {
            let motion = SiteMotion::on_body(&body, placement, &stamps, &poses).unwrap();
            assert_eq!((motion.len(), motion.points.len()), (51, 51));
            let centre: Vector3<f64> = motion.points[7].iter().sum::<Vector3<f64>>() / 9.0;
            let away = (centre - motion.kinematics[7].world_from_sensor.translation.vector).norm();
            assert!(away < 0.06, "{}: {away}", placement.name());
        }
    }
}
