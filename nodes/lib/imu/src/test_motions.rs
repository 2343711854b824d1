//! Motions whose acceleration and angular velocity are known, for the tests of schemes and streams.
#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use cromosim_spatial::{Stamp, so3};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use crate::{ImuSample, KinematicSample, SampleVariance, SensorFrame, SensorTrajectory};

pub(crate) const START: Stamp = Stamp::from_nanos(1_700_000_000_123_456_789);

/// Value, first and second derivative of `amplitude sin(2 pi hz t + phase)`.
fn tone(amplitude: f64, hz: f64, phase: f64, t: f64) -> [f64; 3] {
    let (w, (sine, cosine)) = (TAU * hz, (TAU * hz * t + phase).sin_cos());
    [
        amplitude * sine,
        amplitude * w * cosine,
        -amplitude * w * w * sine,
    ]
}

/// A hard wrist motion: 45 m/s2 and 12.2 rad/s at its peaks.
pub(crate) fn wrist(t: f64) -> KinematicSample {
    let [x, y, z] = [
        tone(0.25, 1.3, 0.0, t),
        tone(0.2, 1.9, 1.0, t),
        tone(0.1, 2.7, 2.0, t),
    ];
    let [yaw, pitch, roll] = [
        tone(1.2, 1.1, 0.0, t),
        tone(0.5, 1.7, 1.0, t),
        tone(0.4, 2.3, 2.0, t),
    ];
    let about_z = so3::exp(&(Vector3::z() * yaw[0]));
    let about_zy = about_z * so3::exp(&(Vector3::y() * pitch[0]));
    let rotation = about_zy * so3::exp(&(Vector3::x() * roll[0]));
    KinematicSample {
        stamp: START.plus_seconds(t),
        world_from_sensor: Isometry3::from_parts(Vector3::new(x[0], y[0], z[0]).into(), rotation),
        acceleration_in_world: Vector3::new(x[2], y[2], z[2]),
        angular_velocity_in_world: Vector3::z() * yaw[1]
            + about_z * Vector3::y() * pitch[1]
            + about_zy * Vector3::x() * roll[1],
        angular_acceleration_in_world: None,
        variance: SampleVariance::default(),
        bandwidth: None,
    }
}

/// A sensor at a lever arm from a centre that stands still, on a body that spins about a fixed axis
/// at a constant rate: `a = w x (w x l)`.
pub(crate) fn spin(t: f64) -> KinematicSample {
    let angular_velocity = Vector3::new(1.0, -2.0, 4.0);
    let rotation = so3::exp(&(angular_velocity * t));
    let lever_arm = rotation * Vector3::new(0.05, 0.2, -0.1);
    KinematicSample {
        stamp: START.plus_seconds(t),
        world_from_sensor: Isometry3::from_parts(
            (Vector3::new(3.0, -4.0, 1.0) + lever_arm).into(),
            rotation,
        ),
        acceleration_in_world: angular_velocity.cross(&angular_velocity.cross(&lever_arm)),
        angular_velocity_in_world: angular_velocity,
        angular_acceleration_in_world: Some(Vector3::zeros()),
        variance: SampleVariance::default(),
        bandwidth: None,
    }
}

/// Frames of a motion at `rate_hz` from t = 0 to `seconds`.
pub(crate) fn frames(
    motion: fn(f64) -> KinematicSample,
    rate_hz: f64,
    seconds: f64,
) -> Vec<SensorFrame> {
    let count = (seconds * rate_hz).round() as usize + 1;
    let frame = |k: usize| {
        let sample = motion(k as f64 / rate_hz);
        SensorFrame::new(sample.stamp, sample.world_from_sensor)
    };
    (0..count).map(frame).collect()
}

pub(crate) fn trajectory(
    motion: fn(f64) -> KinematicSample,
    rate_hz: f64,
    seconds: f64,
) -> SensorTrajectory {
    SensorTrajectory::new(frames(motion, rate_hz, seconds)).unwrap()
}

/// Jitter of 1 mm and 0.5 degrees about each axis, independent per frame.
pub(crate) fn jittered(frames: &[SensorFrame]) -> Vec<SensorFrame> {
    let mut random = ChaCha12Rng::seed_from_u64(7);
    let mut uniform = || ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    let mut normal = || (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos();
    let mut vector = |sigma: f64| Vector3::new(normal(), normal(), normal()) * sigma;
    let shaken = |frame: &SensorFrame| {
        let position = frame.world_from_sensor.translation.vector + vector(0.001);
        let rotation: UnitQuaternion<f64> =
            frame.world_from_sensor.rotation * so3::exp(&vector(0.5_f64.to_radians()));
        SensorFrame::new(
            frame.stamp,
            Isometry3::from_parts(position.into(), rotation),
        )
    };
    frames.iter().map(shaken).collect()
}

/// Root mean square of the errors' lengths: specific force (m/s2) and angular velocity (rad/s),
/// sensor axes of the true motion.
pub(crate) fn errors(
    samples: &[KinematicSample],
    motion: fn(f64) -> KinematicSample,
) -> (f64, f64) {
    let (mut force, mut turn) = (0.0, 0.0);
    for sample in samples {
        let known = motion(sample.stamp - START);
        force += (sample.acceleration_in_world - known.acceleration_in_world).norm_squared();
        turn += (sample.angular_velocity_in_world - known.angular_velocity_in_world).norm_squared();
    }
    let count = samples.len() as f64;
    ((force / count).sqrt(), (turn / count).sqrt())
}

/// As [`errors`], of readings in sensor axes.
pub(crate) fn imu_errors(samples: &[ImuSample], motion: fn(f64) -> KinematicSample) -> (f64, f64) {
    let (mut force, mut turn) = (0.0, 0.0);
    for sample in samples {
        let known = motion(sample.stamp - START).imu();
        force += (sample.specific_force - known.specific_force).norm_squared();
        turn += (sample.angular_velocity - known.angular_velocity).norm_squared();
    }
    let count = samples.len() as f64;
    ((force / count).sqrt(), (turn / count).sqrt())
}
