//! Poses and IMU readings over time.

use std::iter::repeat;

use cromosim_imu::{PoseStd, Reading, SensorFrame};
use cromosim_spatial::Stamp;
use cromosim_spatial::plausible::{Oddity, RIGID_SPEED};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// Poses of one rigid body. All lists have the same length, or are empty where it says so; stamps increase.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseTrajectory {
    /// When.
    pub stamps: Vec<Stamp>,
    /// The body's origin in the world, m.
    pub positions: Vec<Vector3<f64>>,
    /// world_from_body.
    pub rotations: Vec<UnitQuaternion<f64>>,
    /// How far each is off, as far as its markers tell; empty elsewhere.
    pub pose_stds: Vec<PoseStd>,
    /// Name of the world's frame where the file says it; empty elsewhere.
    pub frame: String,
}

impl PoseTrajectory {
    /// Adds a pose at the end.
    pub(crate) fn push(
        &mut self,
        stamp: Stamp,
        position: Vector3<f64>,
        rotation: UnitQuaternion<f64>,
    ) {
        self.stamps.push(stamp);
        self.positions.push(position);
        self.rotations.push(rotation);
    }

    /// What is odd about how it moves.
    pub fn oddities(&self) -> Vec<Oddity> {
        let pairs = self.stamps.windows(2).zip(self.positions.windows(2));
        let speeds = pairs.map(|(stamps, positions)| {
            (positions[1] - positions[0]).norm() / (stamps[1] - stamps[0])
        });
        let fastest = speeds
            .enumerate()
            .max_by(|(_, one), (_, other)| one.total_cmp(other));
        let judged = fastest.and_then(|(row, speed)| {
            RIGID_SPEED.judge(speed, format!("poses {} and {}", row + 1, row + 2))
        });
        judged.into_iter().collect()
    }

    /// The poses as frames of a sensor that is the body.
    pub fn frames(&self) -> Vec<SensorFrame> {
        let stds = self.pose_stds.iter().copied().chain(repeat(PoseStd::NONE));
        let poses = self.positions.iter().zip(&self.rotations).zip(stds);
        let frame = |(stamp, ((position, rotation), std)): (&Stamp, ((&Vector3<f64>, &_), _))| {
            let pose = Isometry3::from_parts((*position).into(), *rotation);
            SensorFrame::new(*stamp, pose).with_pose_std(std)
        };
        self.stamps.iter().zip(poses).map(frame).collect()
    }
}

/// Readings of one IMU. All lists have the same length; stamps increase.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImuSeries {
    /// When.
    pub stamps: Vec<Stamp>,
    /// Accelerometer in its own axes, m/s2: +g up at rest.
    pub specific_force: Vec<Vector3<f64>>,
    /// Gyroscope in its own axes, rad/s.
    pub angular_velocity: Vec<Vector3<f64>>,
}

impl ImuSeries {
    /// Adds a reading at the end.
    pub(crate) fn push(
        &mut self,
        stamp: Stamp,
        specific_force: Vector3<f64>,
        angular_velocity: Vector3<f64>,
    ) {
        self.stamps.push(stamp);
        self.specific_force.push(specific_force);
        self.angular_velocity.push(angular_velocity);
    }

    /// The readings, one for each stamp.
    pub fn readings(&self) -> Vec<Reading> {
        let both = self.specific_force.iter().zip(&self.angular_velocity);
        let reading =
            |(specific_force, angular_velocity): (&Vector3<f64>, &Vector3<f64>)| Reading {
                specific_force: *specific_force,
                angular_velocity: *angular_velocity,
            };
        both.map(reading).collect()
    }
}

/// The inverse of the median interval, Hz; none without two stamps.
pub(crate) fn median_rate(stamps: &[Stamp]) -> Option<f64> {
    let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_unstable_by(f64::total_cmp);
    intervals
        .get(intervals.len() / 2)
        .map(|interval| interval.recip())
}
