//! What every motion has to keep: seen in a mirror, backwards, or by a slower source it is the same.
#![allow(clippy::unwrap_used)]

use cromosim_spatial::uniform_stamps;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use crate::test_motions::{START, frames, jittered, wrist};
use crate::{KinematicSample, Scheme, SensorFrame, SensorTrajectory, simulate_kinematics};

const SECONDS: f64 = 6.0;

fn simulated(frames: Vec<SensorFrame>) -> Vec<KinematicSample> {
    let output = uniform_stamps(START, START.plus_seconds(SECONDS), 100.0).unwrap();
    let trajectory = SensorTrajectory::new(frames).unwrap();
    simulate_kinematics(&trajectory, Scheme::default(), &output).unwrap()
}

/// At 120 Hz with 1 mm and 0.5 degrees of error.
fn source() -> Vec<SensorFrame> {
    jittered(&frames(wrist, 120.0, SECONDS))
}

fn rms(values: impl Iterator<Item = Vector3<f64>> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    (values.map(|v| v.norm_squared()).sum::<f64>() / count).sqrt()
}

/// Left and right changed: y is -y of vectors, and of rotations' axes x and z turn round.
#[test]
fn a_mirrored_motion_gives_the_mirrored_readings() {
    let mirrored = |v: Vector3<f64>| Vector3::new(v.x, -v.y, v.z);
    let mirror = |frame: &SensorFrame| {
        let pose = frame.world_from_sensor;
        let q = pose.rotation.quaternion();
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(q.w, -q.i, q.j, -q.k));
        let position = mirrored(pose.translation.vector);
        SensorFrame::new(
            frame.stamp,
            Isometry3::from_parts(position.into(), rotation),
        )
    };
    let source = source();
    let image = simulated(source.iter().map(mirror).collect());
    for (one, other) in simulated(source).iter().zip(&image) {
        let force = mirrored(one.acceleration_in_world) - other.acceleration_in_world;
        // An axial vector.
        let turn = mirrored(one.angular_velocity_in_world) + other.angular_velocity_in_world;
        assert!(
            force.norm() < 1e-6 && turn.norm() < 1e-6,
            "{force} {turn} at {:.2} s",
            one.stamp - START
        );
    }
}

#[test]
fn a_motion_backwards_gives_the_readings_backwards() {
    let source = source();
    let back = |frame: &SensorFrame| {
        let stamp = START.plus_seconds(SECONDS - (frame.stamp - START));
        SensorFrame::new(stamp, frame.world_from_sensor)
    };
    let mut backwards = simulated(source.iter().rev().map(back).collect());
    backwards.reverse();
    for (one, other) in simulated(source).iter().zip(&backwards) {
        let force = one.acceleration_in_world - other.acceleration_in_world;
        let turn = one.angular_velocity_in_world + other.angular_velocity_in_world;
        // Stamps are whole nanoseconds.
        assert!(
            force.norm() < 1e-4 && turn.norm() < 1e-5,
            "{force} {turn} at {:.2} s",
            one.stamp - START
        );
    }
}

/// The same motion by sources of 120, 60 and 30 Hz: their readings differ by what they state, and
/// by less than a tenth of the signal.
#[test]
fn slower_sources_agree_within_what_they_state() {
    let source = source();
    let fast = simulated(source.clone());
    for (every, most) in [(2, 0.05), (4, 0.1)] {
        let slow = simulated(source.iter().step_by(every).copied().collect());
        let inside = || fast.iter().zip(&slow).skip(20).take(fast.len() - 40);
        let difference = |(a, b): (&KinematicSample, &KinematicSample)| {
            a.acceleration_in_world - b.acceleration_in_world
        };
        let share =
            rms(inside().map(difference)) / rms(inside().map(|(a, _)| a.acceleration_in_world));
        let over_stated = inside()
            .map(|(a, b)| difference((a, b)).norm_squared() / (3.0 * b.variance.acceleration))
            .sum::<f64>()
            / inside().count() as f64;
        println!(
            "{} Hz: {share:.3} of the signal, {over_stated:.2} of the stated variance",
            120 / every
        );
        assert!(share < most && over_stated < 1.4, "{share} {over_stated}");
    }
}
