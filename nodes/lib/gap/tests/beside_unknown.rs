//! Effects of the library beside one that is outside of it.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_gap::Gap;
use cromosim_imu::EffectKind as K;
use support::Scene;
use support::judge::{answer, names, values_are};

/// A gyroscope whose error grows with the square of its own rate (rad/s per (rad/s)^2), on top of
/// what the library has.
fn with_squares(scene: &Scene, factor: f64) -> cromosim_gap::PlacementRecord {
    let mut record = scene.record();
    for reading in &mut record.imu.readings {
        let rate = reading.angular_velocity;
        reading.angular_velocity += factor * rate.map(|axis| axis * axis.abs());
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
