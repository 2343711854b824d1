//! What a network sees of a motion, and what it says.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::{PATCH_POINTS, SiteMotion};

/// Sizes that bring every channel near 1: travel within a window and the patch's own size, m.
const TRAVEL: f64 = 0.3;
const PATCH_SIZE: f64 = 0.03;
/// Of unsmoothed acceleration, m/s2, which is mostly noise.
const UNSMOOTHED: f64 = 15.0;

/// So many samples later are the plain differences that [`Input::Streaming`] sees: for states of 60
/// Hz within the spline's own delay.
pub(crate) const AHEAD: usize = 8;

/// What a network predicts, world axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Acceleration without gravity, m/s2.
    Acceleration,
    /// Angular velocity, rad/s.
    AngularVelocity,
}

impl Quantity {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::Acceleration, Self::AngularVelocity];

    /// What a network's output of 1 stands for, m/s2 or rad/s.
    pub fn scale(self) -> f64 {
        match self {
            Self::Acceleration => 5.0,
            Self::AngularVelocity => 2.0,
        }
    }

    /// As in file names and configurations.
    pub fn name(self) -> &'static str {
        match self {
            Self::Acceleration => "acceleration",
            Self::AngularVelocity => "angular_velocity",
        }
    }
}

/// What a network is fed, per sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Input {
    /// The paper's: the nine points relative to the window, 27 channels. Their mean less its mean
    /// over the window, and eight points less the mean of all nine (the ninth follows from them).
    Points,
    /// The same and the analytic acceleration and angular velocity, 33 channels; the network says
    /// what is to be added to these.
    Residual,
    /// The same and acceleration and angular velocity by plain differences, 39 channels: for motion
    /// whose scatter makes the analytic simulation smooth much, video above all.
    Differences,
    /// Eight points less their mean, the analytic acceleration and angular velocity, and those by
    /// plain differences eight samples later, 36 channels: nothing that needs a window. The network
    /// says what is to be added.
    Streaming,
}

impl Input {
    /// As in files and configurations.
    pub fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Residual => "residual",
            Self::Differences => "differences",
            Self::Streaming => "streaming",
        }
    }

    /// The input of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        [
            Self::Points,
            Self::Residual,
            Self::Differences,
            Self::Streaming,
        ]
        .into_iter()
        .find(|input| input.name() == name)
    }

    /// Channels.
    pub fn channels(self) -> usize {
        match self {
            Self::Points => 27,
            Self::Residual => 33,
            Self::Differences => 39,
            Self::Streaming => 36,
        }
    }

    /// Whether the network's output is added to the analytic value.
    pub fn on_top_of_analytic(self) -> bool {
        self != Self::Points
    }

    /// Appends `count` samples from `first` on, (samples, channels), all turned by `turn`. Samples
    /// beyond the motion's end repeat its last.
    pub fn fill(
        self,
        motion: &SiteMotion,
        first: usize,
        count: usize,
        turn: &UnitQuaternion<f64>,
        features: &mut Vec<f32>,
    ) {
        let last = motion.len().saturating_sub(1);
        let at = |k: usize| (first + k).min(last);
        let origin = match self {
            Self::Streaming => Vector3::zeros(),
            _ => {
                (0..count)
                    .map(|k| mean(&motion.points[at(k)]))
                    .sum::<Vector3<f64>>()
                    / count.max(1) as f64
            }
        };
        for k in 0..count {
            let ahead = if self == Self::Streaming { AHEAD } else { 0 };
            let unsmoothed = &motion.unsmoothed[(at(k) + ahead).min(last)];
            self.sample(
                &motion.points[at(k)],
                &motion.kinematics[at(k)],
                unsmoothed,
                &origin,
                turn,
                features,
            );
        }
    }

    /// Appends one sample; `origin` is the mean of the window's points (of no meaning to
    /// [`Self::Streaming`]), `unsmoothed` as in [`SiteMotion::unsmoothed`] (of meaning to
    /// [`Self::Differences`] and, [`AHEAD`], to [`Self::Streaming`]).
    pub(crate) fn sample(
        self,
        points: &[Vector3<f64>; PATCH_POINTS],
        kinematic: &cromosim_imu::KinematicSample,
        unsmoothed: &[Vector3<f64>; 2],
        origin: &Vector3<f64>,
        turn: &UnitQuaternion<f64>,
        features: &mut Vec<f32>,
    ) {
        let mut push = |value: Vector3<f64>, scale: f64| {
            features.extend((turn * value / scale).iter().map(|x| *x as f32))
        };
        let centre = mean(points);
        if self != Self::Streaming {
            push(centre - origin, TRAVEL);
        }
        for point in &points[..PATCH_POINTS - 1] {
            push(point - centre, PATCH_SIZE);
        }
        if self.on_top_of_analytic() {
            push(
                kinematic.acceleration_in_world,
                Quantity::Acceleration.scale(),
            );
            push(
                kinematic.angular_velocity_in_world,
                Quantity::AngularVelocity.scale(),
            );
        }
        if matches!(self, Self::Differences | Self::Streaming) {
            // How much to smooth changes within a motion, and the analytic simulation smooths all
            // of it alike.
            let [acceleration, angular_velocity] = *unsmoothed;
            push(acceleration, UNSMOOTHED);
            push(angular_velocity, Quantity::AngularVelocity.scale());
        }
    }
}

fn mean(points: &[Vector3<f64>; PATCH_POINTS]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / PATCH_POINTS as f64
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use cromosim_imu::{Scheme, SensorFrame, SensorTrajectory};
    use cromosim_spatial::Stamp;
    use nalgebra::Isometry3;

    use super::*;

    fn motion(shift: Vector3<f64>, turn: UnitQuaternion<f64>) -> SiteMotion {
        let frame = |k: u32| {
            let seconds = f64::from(k) / 100.0;
            let at = Isometry3::new(
                Vector3::new((3.0 * seconds).sin(), seconds, 0.2),
                Vector3::new(0.0, seconds, 0.3),
            );
            SensorFrame::new(
                Stamp::from_seconds(seconds),
                Isometry3::from_parts(shift.into(), turn) * at,
            )
        };
        SiteMotion::rigid(
            &SensorTrajectory::new((0..60).map(frame).collect()).unwrap(),
            Scheme::Richardson,
        )
        .unwrap()
    }

    fn features(input: Input, motion: &SiteMotion, turn: &UnitQuaternion<f64>) -> Vec<f32> {
        let mut features = Vec::new();
        input.fill(motion, 10, 40, turn, &mut features);
        assert_eq!(features.len(), 40 * input.channels());
        features
    }

    fn largest_difference(a: &[f32], b: &[f32]) -> f32 {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max)
    }

    #[test]
    fn features_do_not_know_where_in_the_world_they_are() {
        let (none, turn) = (
            UnitQuaternion::identity(),
            UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0),
        );
        let here = motion(Vector3::zeros(), none);
        let there = motion(Vector3::new(12.0, -7.0, 3.0), none);
        let turned = motion(Vector3::zeros(), turn);
        for input in [
            Input::Points,
            Input::Residual,
            Input::Differences,
            Input::Streaming,
        ] {
            let own = features(input, &here, &none);
            assert!(
                largest_difference(&own, &features(input, &there, &none)) < 1e-5,
                "{input:?}"
            );
            // Turning the features is turning the motion.
            assert!(
                largest_difference(
                    &features(input, &here, &turn),
                    &features(input, &turned, &none)
                ) < 1e-5,
                "{input:?}"
            );
            assert!(own.iter().all(|value| value.abs() < 10.0));
        }
    }

    #[test]
    fn what_lies_beyond_the_end_repeats_the_last_sample() {
        let motion = motion(Vector3::zeros(), UnitQuaternion::identity());
        let mut features = Vec::new();
        Input::Streaming.fill(&motion, 50, 30, &UnitQuaternion::identity(), &mut features);
        let rows: Vec<&[f32]> = features.chunks_exact(36).collect();
        assert_eq!(rows[29], rows[9]);
        assert_ne!(rows[8], rows[9]);
    }
}
