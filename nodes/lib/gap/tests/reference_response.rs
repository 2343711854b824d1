//! References that show more or less of a motion than there is, by no effect of the library.
#![allow(clippy::unwrap_used)]

mod support;

use std::f64::consts::PI;

use cromosim_gap::{PlacementAnswer, PlacementRecord};
use cromosim_imu::{EffectKind as K, PlacementEffects, SensorModel};
use cromosim_spatial::{PoseEstimate, so3};
use nalgebra::{Quaternion, UnitQuaternion};
use support::judge::answer;
use support::motion::Motion;
use support::{REFERENCE_HZ, Scene};

/// How often the rotations of [`smoothed`] go through the mean with their neighbours, weights 1, 2, 1: what is left at f
/// is `cos^2(pi f / 120 Hz)` to this power, 0.79 at 3.5 Hz.
const TIMES: i32 = 28;

/// With smoothed rotations, beside positions that are not.
fn smoothed(mut record: PlacementRecord) -> PlacementRecord {
    let mut turns: Vec<Quaternion<f64>> = so3::sign_continuous(&record.reference.rotations);
    for _ in 0..TIMES {
        let before = turns.clone();
        for (turn, near) in turns[1..].iter_mut().zip(before.windows(3)) {
            *turn = (near[0] + near[1] * 2.0 + near[2]) * 0.25;
        }
    }
    record.reference.rotations = turns
        .into_iter()
        .map(UnitQuaternion::from_quaternion)
        .collect();
    record
}

/// Root mean square of the gyroscope's vector residual without the reference's first and last second.
fn gyro_gap(record: &PlacementRecord, effects: &PlacementEffects) -> f64 {
    let poses = &record.reference;
    let mut estimate =
        PoseEstimate::fit(&poses.stamps, &poses.positions, &poses.rotations).unwrap();
    if let Some(response) = &effects.reference_response {
        estimate = estimate.with_response(response);
    }
    let model = SensorModel::new(&effects.effects, effects.epoch);
    let simulated = model.run(&estimate.track(200.0), &record.imu.stamps);
    let pairs = record
        .imu
        .stamps
        .iter()
        .zip(record.imu.readings.iter().zip(&simulated));
    let squares: Vec<f64> = pairs
        .filter(|(stamp, _)| **stamp - estimate.start() > 1.0 && estimate.end() - **stamp > 1.0)
        .map(|(_, (one, other))| (one.angular_velocity - other.angular_velocity).norm_squared())
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn rotations_that_were_smoothed_alone_are_made_up_for() {
    let scene = Scene::new(41);
    let PlacementAnswer {
        diagnosis, effects, ..
    } = answer(&smoothed(scene.record()));
    let response = effects.reference_response.clone().unwrap();
    // A part of it passes for a scale of the gyroscope, and motion is not in the middle of each band.
    let scale = effects.effects.get(K::GyroScale);
    let scale = scale.map_or(1.0, |effect| effect.values().iter().sum::<f64>() / 3.0);
    for hz in [1.5, 2.5, 3.5] {
        let left = (PI * hz / REFERENCE_HZ).cos().powi(2 * TIMES);
        let found = scale * response.of_rotation(hz);
        let expected = 1.0 / left;
        assert!(
            (found / expected - 1.0).abs() < 0.08,
            "{hz} Hz: {found}, expected {expected}"
        );
    }
    assert!(response.of_rotation(3.5) > 1.05 * response.of_rotation(1.5));
    let said = diagnosis.reference_response.as_ref().unwrap();
    assert_eq!(said.gyro, response.rotation);
    // In another recording of the same cameras.
    let later = smoothed(scene.again(90.0).record());
    let plain = PlacementEffects {
        reference_response: None,
        ..effects.clone()
    };
    let (with, without) = (gyro_gap(&later, &effects), gyro_gap(&later, &plain));
    assert!(with < 0.6 * without, "{with} rad/s, {without} without");
    let promised = diagnosis.gap.after.gyro_rmse;
    assert!(
        (with / promised - 1.0).abs() < 0.15,
        "{with} rad/s, {promised} promised"
    );
}

/// What cameras see of a scene whose rotations they have trembling, 0.07 rad/s from 2 to 6 Hz.
fn trembling(scene: &Scene) -> PlacementRecord {
    let seen = Scene {
        motion: scene.motion.clone().trembling(0.04, 2.0..6.0, 5),
        ..scene.clone()
    };
    PlacementRecord {
        reference: seen.record().reference,
        ..scene.record()
    }
}

#[test]
fn errors_beside_a_slow_motion_are_no_part_of_a_livelier_one() {
    let slow = Scene {
        motion: Motion::random(45).slowed(3.0),
        ..Scene::new(45)
    };
    let slow = slow.with(K::TimeOffset, &[0.03]);
    let effects = answer(&trembling(&slow)).effects;
    let response = effects.reference_response.clone().unwrap();
    assert!(response.of_rotation(3.5) < 0.5, "{response:?}");
    let plain = PlacementEffects {
        reference_response: None,
        ..effects.clone()
    };
    let livelier = Scene {
        motion: Motion::random(46),
        ..slow.clone()
    };
    for (scene, part) in [(&slow, 0.8), (&livelier, 1.02)] {
        let later = trembling(&scene.again(90.0));
        let (with, without) = (gyro_gap(&later, &effects), gyro_gap(&later, &plain));
        assert!(with < part * without, "{with} rad/s, {without} without");
    }
}

#[test]
fn an_ordinary_reference_is_taken_as_it_is() {
    for seed in [43, 44] {
        let plain = answer(&Scene::new(seed).record());
        assert_eq!(plain.effects.reference_response, None);
        let late = answer(&Scene::new(seed).with(K::TimeOffset, &[0.03]).record());
        assert_eq!(late.effects.reference_response, None);
    }
}
