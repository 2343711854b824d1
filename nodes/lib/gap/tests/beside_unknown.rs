//! Effects of the library beside one that is outside of it.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_gap::{DiagnoseOptions, Gap, PlacementRecord, diagnose_together};
use cromosim_imu::{EffectKind as K, Reading};
use nalgebra::{Rotation3, Vector3};
use support::Scene;
use support::judge::{answer, names, values_are};

/// A gyroscope whose error grows with the square of its own rate (rad/s per (rad/s)^2), on top of
/// what the library has.
fn with_squares(scene: &Scene, factor: f64) -> PlacementRecord {
    let mut record = scene.record();
    for reading in &mut record.imu.readings {
        let rate = reading.angular_velocity;
        reading.angular_velocity += factor * rate.map(|axis| axis * axis.abs());
    }
    record
}

/// A mount that is turned by a twentieth of a radian where a reading, and its seconds since the first, say so.
fn with_loose_mount(scene: &Scene, is_turned: impl Fn(&Reading, f64) -> bool) -> PlacementRecord {
    let mut record = scene.record();
    let turn = Rotation3::new(Vector3::new(0.02, 0.04, -0.02));
    let start = record.imu.stamps[0];
    for (reading, stamp) in record.imu.readings.iter_mut().zip(&record.imu.stamps) {
        if is_turned(reading, *stamp - start) {
            reading.specific_force = turn.inverse() * reading.specific_force;
            reading.angular_velocity = turn.inverse() * reading.angular_velocity;
        }
    }
    record
}

#[test]
fn what_explains_as_much_as_any_regression_would_stays_a_cause() {
    // The family "other axes" holds every misalignment, and yet that is the plainer answer.
    let scene = Scene::new(70)
        .with(K::GyroMisalignment, &[0.04, -0.03, 0.05])
        .with(K::LeverArm, &[0.03, 0.02, -0.04]);
    let diagnosis = answer(&with_squares(&scene, 0.004)).diagnosis;
    let said = names(&diagnosis);
    for effect in ["gyro_misalignment", "lever_arm", "unknown"] {
        assert!(said.contains(&effect), "{effect}: {}", diagnosis.verdict);
    }
    values_are(&diagnosis, scene.effects.get(K::LeverArm).unwrap());
}

#[test]
fn what_is_unknown_takes_nothing_away() {
    let scene = Scene::new(72).with(K::LeverArm, &[0.02, 0.0, -0.02]);
    let diagnosis = answer(&with_squares(&scene, 0.03)).diagnosis;
    let [first, .., last] = &diagnosis.causes[..] else {
        panic!("{}", diagnosis.verdict)
    };
    assert_eq!(first.effect, "unknown", "{}", diagnosis.verdict);
    assert_eq!(first.after, diagnosis.gap.before);
    assert_eq!(last.after, diagnosis.gap.after);
}

#[test]
fn a_gain_that_may_only_pass_for_the_unknown_is_simulated_all_the_same() {
    let answer = answer(&with_squares(&Scene::new(71), 0.02));
    let (diagnosis, simulated) = (answer.diagnosis, answer.effects.effects);
    assert_eq!(names(&diagnosis), ["unknown"], "{}", diagnosis.verdict);
    assert!(simulated.contains(K::GyroScale), "{simulated:?}");
    let kept = diagnosis.calibration.iter().map(|kept| &kept.effect[..]);
    assert_eq!(kept.collect::<Vec<_>>(), ["gyro_scale"]);
    // The best line through x |x| leaves a third or so of it.
    let Gap { before, after } = diagnosis.gap;
    assert!(after.gyro_rmse < 0.5 * before.gyro_rmse, "{after:?}");
}

#[test]
fn such_a_gain_is_shown_by_the_other_recordings_too() {
    let scene = |seed| Scene {
        seconds: 30.0,
        ..Scene::new(seed)
    };
    let mut second = scene(71);
    second.start = second.start.plus_seconds(5000.0);
    second.epoch = second.start;
    let [first, second] = [scene(72), second].map(|scene| with_squares(&scene, 0.02));
    let recordings = [("first", &first), ("second", &second)];
    let (answer, _) = diagnose_together(&recordings, &DiagnoseOptions::default()).unwrap();
    assert_eq!(names(&answer.diagnosis), ["unknown"]);
    assert!(answer.effects.effects.contains(K::GyroScale));
    for one in &answer.diagnosis.recordings {
        let (before, left_out) = (one.gap.before.gyro_rmse, one.left_out.gyro_rmse);
        assert!(left_out < 0.5 * before, "{before} to {left_out}");
    }
}

#[test]
fn the_mean_of_a_curve_over_time_is_no_bias() {
    let bias_simulated = |curve: fn(f64) -> f64| {
        let mut record = Scene::new(71).record();
        let count = record.imu.readings.len() as f64;
        for (k, reading) in record.imu.readings.iter_mut().enumerate() {
            reading.angular_velocity.z += curve(k as f64 / count);
        }
        let answer = answer(&record);
        let said = names(&answer.diagnosis);
        assert_eq!(said, ["unknown"], "{}", answer.diagnosis.verdict);
        let bias = answer.effects.effects.get(K::GyroBias)?;
        Some(bias.values()[2])
    };
    // One that has turned round at the end is worse than none there.
    let turns = bias_simulated(|time| 0.08 * (0.7 - time * time));
    assert_eq!(turns, None);
    let stays = bias_simulated(|time| 0.1 * (time - time * time));
    assert!(
        stays.is_some_and(|bias| (bias - 0.017).abs() < 0.002),
        "{stays:?}"
    );
}

/// A mount that knocks to and fro is neither turned by its mean angle, nor was it turned once.
#[test]
fn the_little_of_the_unknown_that_effects_follow_is_no_cause_of_its_own() {
    let knocks = |_: &Reading, t: f64| (0.37 * t + 2.0 * (0.11 * t).sin()).sin() > 0.3;
    for seed in [70, 73, 74] {
        let diagnosis = answer(&with_loose_mount(&Scene::new(seed), knocks)).diagnosis;
        assert_eq!(names(&diagnosis), ["unknown"], "{}", diagnosis.verdict);
        let kept = diagnosis.calibration.iter().map(|kept| &kept.effect[..]);
        assert_eq!(kept.collect::<Vec<_>>(), ["mount_rotation"], "seed {seed}");
        let Gap { before, after } = diagnosis.gap;
        assert!(after.accel_rmse < 0.9 * before.accel_rmse, "{after:?}");
    }
}

/// Its mean angle takes so little off the gap that another recording may well have another.
#[test]
fn what_takes_little_off_a_large_unknown_is_not_kept() {
    let knocks = |_: &Reading, t: f64| (2.3 * t + 2.0 * (0.11 * t).sin()).sin() > 0.92;
    for seed in [70, 73, 74] {
        let diagnosis = answer(&with_loose_mount(&Scene::new(seed), knocks)).diagnosis;
        assert_eq!(names(&diagnosis), ["unknown"], "{}", diagnosis.verdict);
        assert_eq!(diagnosis.calibration, [], "seed {seed}");
    }
}

#[test]
fn a_mount_that_is_turned_in_one_posture_is_not_simulated_in_all() {
    let mount_simulated = |slower: f64, force: f64| {
        let mut scene = Scene::new(73);
        scene.motion = scene.motion.slowed(slower);
        let is_turned = |reading: &Reading, _: f64| reading.specific_force.x > force;
        let answer = answer(&with_loose_mount(&scene, is_turned));
        let said = names(&answer.diagnosis);
        assert_eq!(said, ["unknown"], "{}", answer.diagnosis.verdict);
        answer.effects.effects.contains(K::MountRotation)
    };
    assert!(!mount_simulated(4.0, 4.0), "a tenth of the time");
    let is_simulated = mount_simulated(1.0, 2.0);
    assert!(is_simulated, "a third of it, in most postures");
}

#[test]
fn what_the_unknown_part_depends_on_is_shown() {
    let factor = 0.02;
    let evidence = answer(&with_squares(&Scene::new(71), factor)).evidence;
    let curve = evidence
        .dependences
        .iter()
        .find(|curve| curve.depends_on == "angular rate")
        .unwrap_or_else(|| panic!("{:?}", evidence.dependences));
    assert!(
        curve.axis.starts_with("gyro_") && curve.x_label.contains("angular velocity"),
        "{} over {}",
        curve.axis,
        curve.x_label
    );
    assert!((0.3..=1.0).contains(&curve.share) && (300..=600).contains(&curve.points.len()));
    // Scale factors that stand in take the straight part of it: what is left of x |x| bends both ways.
    let reach = curve
        .means
        .iter()
        .map(|mean| mean.1.abs())
        .fold(0.0, f64::max);
    let largest = curve
        .means
        .iter()
        .map(|mean| mean.0.abs())
        .fold(0.0, f64::max);
    assert!(
        reach > 0.1 * factor * largest * largest,
        "{:?}",
        curve.means
    );
    let calm = answer(&Scene::new(71).record()).evidence;
    assert_eq!(calm.dependences, [], "nothing is unknown, nothing is shown");
}
