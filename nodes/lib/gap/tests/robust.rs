//! What must not change an answer, and what must be refused.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_gap::{DiagnoseOptions, GapError, PlacementRecord, diagnose};
use cromosim_imu::{EffectKind as K, EffectSet, PerChannel};
use cromosim_spatial::Stamp;
use nalgebra::Vector3;
use support::judge::{answer, cause, names, names_exactly, near, shares_add_up, values_are};
use support::motion::Motion;
use support::{IMU_HZ, SIGMA, Scene};

fn lever_and_bias(seed: u64) -> Scene {
    Scene::new(seed)
        .with(K::LeverArm, &[0.05, 0.02, -0.06])
        .with(K::AccelBias, &[0.2, -0.15, 0.1])
}

#[test]
fn the_motions_derivatives_are_those_of_its_values() {
    let (motion, h) = (Motion::random(3), 1e-4);
    for k in 0..200 {
        let t = 0.31 * f64::from(k);
        let [before, now, after] = [t - h, t, t + h].map(|t| motion.at(t));
        let acceleration = (after.position - now.position * 2.0 + before.position) / (h * h);
        assert!((acceleration - now.acceleration_in_world).norm() < 1e-4);
        let turned = (before.world_from_segment.inverse() * after.world_from_segment).scaled_axis()
            / (2.0 * h);
        assert!((turned - now.angular_velocity).norm() < 1e-5);
        let change = (after.angular_velocity - before.angular_velocity) / (2.0 * h);
        assert!((change - now.angular_acceleration).norm() < 1e-3);
        near(now.world_from_segment.norm(), 1.0, 1e-12, "unit quaternion");
    }
}

#[test]
fn no_effect_has_no_cause() {
    for seed in [1, 2, 3] {
        let diagnosis = answer(&Scene::new(seed).record()).diagnosis;
        assert_eq!(names(&diagnosis), [""; 0], "{}", diagnosis.verdict);
        assert!(!diagnosis.unexplained.significant);
        shares_add_up(&diagnosis);
        // What is left is the sensor's noise and the reference's own error, of which noise is the
        // least.
        assert!(
            diagnosis.gap.before.accel_rmse > SIGMA[0] && diagnosis.gap.before.gyro_rmse > SIGMA[1]
        );
        near(
            diagnosis.gap.after.accel_rmse,
            diagnosis.gap.before.accel_rmse,
            1e-12,
            "nothing is added",
        );
    }
}

#[test]
fn what_sways_has_neither_a_lag_nor_other_units() {
    // The angular speed is the same after each half of a period.
    for (hz, seed) in [(0.8, 5), (1.93, 6), (1.93, 7)] {
        let scene = Scene {
            motion: Motion::sway(hz),
            ..Scene::new(seed)
        };
        let diagnosis = answer(&scene.record()).diagnosis;
        let named = names(&diagnosis);
        // What the reference's filter leaves of its noise has the one frequency too, and goes with the motion.
        let is_known = |name: &&str| *name != "unknown";
        assert!(!named.iter().any(is_known), "{hz} Hz: {named:?}");
        let (before, after) = (
            diagnosis.gap.before.accel_rmse,
            diagnosis.gap.after.accel_rmse,
        );
        near(after, before, 1e-3, "no worse");
    }
}

#[test]
fn undeclared_noise_counts_as_declared() {
    let mut scene = Scene::new(4);
    scene.declared = PerChannel::default();
    assert_eq!(names(&answer(&scene.record()).diagnosis), [""; 0]);
    // Even where it is large.
    let loud = scene
        .with(K::AccelNoise, &[0.01])
        .with(K::GyroNoise, &[1e-3]);
    let answer = answer(&loud.record());
    assert_eq!(
        names(&answer.diagnosis),
        [""; 0],
        "{}",
        answer.diagnosis.verdict
    );
    near(
        answer.effects.declared_noise.accel_density,
        0.01f64.hypot(SIGMA[0] / IMU_HZ.sqrt()),
        5e-4,
        "density that was found",
    );
}

#[test]
fn holes_in_the_reference_are_no_cause() {
    let mut scene = Scene::new(5);
    scene.lost = vec![7.0..7.5, 21.2..21.7, 33.3..33.8, 50.0..50.5];
    assert_eq!(names(&answer(&scene.record()).diagnosis), [""; 0]);
    let mut scene = lever_and_bias(6);
    scene.lost = vec![7.0..7.5, 21.2..21.7, 33.3..33.8, 50.0..50.5];
    let diagnosis = answer(&scene.record()).diagnosis;
    names_exactly(&diagnosis, &scene.effects);
    scene
        .effects
        .iter()
        .for_each(|effect| values_are(&diagnosis, effect));
}

#[test]
fn dropped_messages_hide_no_other_cause() {
    let scene = lever_and_bias(8).with(K::DroppedSamples, &[0.08, 4.0]);
    let diagnosis = answer(&scene.record()).diagnosis;
    names_exactly(&diagnosis, &scene.effects);
    values_are(&diagnosis, scene.effects.get(K::LeverArm).unwrap());
}

#[test]
fn a_quarter_turn_is_axes_named_otherwise() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let record = Scene::new(9)
        .with(K::MountRotation, &[0.0, 0.0, quarter])
        .record();
    let diagnosis = answer(&record).diagnosis;
    assert_eq!(
        names(&diagnosis),
        ["axis_convention"],
        "{}",
        diagnosis.verdict
    );
    // M = R_mount^T
    let matrix = serde_json::json!([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(
        cause(&diagnosis, K::AxisConvention).parameters["matrix"],
        matrix
    );
    // A third of a degree beside it is a mount's, beside the axes.
    let scene = Scene::new(9).with(K::MountRotation, &[0.0, 0.0, quarter - 0.006]);
    let diagnosis = answer(&scene.record()).diagnosis;
    assert_eq!(
        names(&diagnosis),
        ["axis_convention", "mount_rotation"],
        "{}",
        diagnosis.verdict
    );
    // Ten degrees beside it is a mount.
    let scene = Scene::new(9).with(K::MountRotation, &[0.0, 0.0, quarter - 0.18]);
    names_exactly(&answer(&scene.record()).diagnosis, &scene.effects);
}

#[test]
fn other_epoch_same_answer() {
    let today = lever_and_bias(10).with(K::ClockDrift, &[300.0]).record();
    let shift = |stamps: &[Stamp], nanos: i64| {
        stamps
            .iter()
            .map(|stamp| Stamp::from_nanos(stamp.nanos - nanos))
            .collect::<Vec<_>>()
    };
    let json = |record: &PlacementRecord| {
        let mut diagnosis = answer(record).diagnosis;
        assert_eq!(
            names(&diagnosis),
            ["accel_bias", "clock_drift", "lever_arm"]
        );
        diagnosis.verdict.clear();
        serde_json::to_string(&diagnosis).unwrap()
    };
    // To the byte: stamps are whole nanoseconds, and only their differences may count.
    let nanos = today.imu.stamps[0].nanos;
    let mut early = today.clone();
    early.reference.stamps = shift(&today.reference.stamps, nanos);
    early.imu.stamps = shift(&today.imu.stamps, nanos);
    assert_eq!(json(&today), json(&early));
}

#[test]
fn same_input_same_bytes_and_any_number_of_threads() {
    let record = lever_and_bias(11).record();
    let json = || {
        let answer = answer(&record);
        (
            serde_json::to_string(&answer.diagnosis).unwrap(),
            answer.effects,
        )
    };
    let alone = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let four = rayon::ThreadPoolBuilder::new()
        .num_threads(4)
        .build()
        .unwrap();
    let first = json();
    assert!(first == alone.install(json) && first == four.install(json));
}

#[test]
fn rest_has_no_cause_and_cannot_tell_the_lever_arm() {
    let mut scene = Scene::new(12);
    scene.motion = Motion::rest();
    let diagnosis = answer(&scene.record()).diagnosis;
    assert_eq!(names(&diagnosis), [""; 0], "{}", diagnosis.verdict);
    let unidentifiable: Vec<&str> = diagnosis
        .unidentifiable
        .iter()
        .map(|item| item.effect.as_str())
        .collect();
    for kind in [
        K::LeverArm,
        K::ClockDrift,
        K::GyroScale,
        K::AccelScale,
        K::ReferenceScale,
    ] {
        assert!(
            unidentifiable.contains(&kind.name()),
            "{kind} of {unidentifiable:?}"
        );
    }
    assert!(
        !unidentifiable.contains(&"gyro_bias"),
        "rest shows a gyroscope's bias best"
    );
    assert!(
        diagnosis
            .unidentifiable
            .iter()
            .all(|item| !item.would_tell.is_empty())
    );
    // Motion tells all of them but what only rest in several orientations would.
    let moving = answer(&Scene::new(13).record()).diagnosis;
    assert!(
        moving
            .unidentifiable
            .iter()
            .all(|item| item.effect != "lever_arm"),
        "{:?}",
        moving.unidentifiable
    );
}

#[test]
fn what_is_known_at_rest_is_found_there() {
    let mut scene = Scene::new(14).with(K::GyroBias, &[0.02, -0.03, 0.015]);
    scene.motion = Motion::rest();
    let diagnosis = answer(&scene.record()).diagnosis;
    // How sure is another question: at rest a sensitivity to gravity reads the same.
    assert_eq!(names(&diagnosis), ["gyro_bias"], "{}", diagnosis.verdict);
    values_are(&diagnosis, scene.effects.get(K::GyroBias).unwrap());
}

fn refusal(record: &PlacementRecord) -> GapError {
    diagnose(record, &DiagnoseOptions::default())
        .map(|_| ())
        .unwrap_err()
}

fn short() -> PlacementRecord {
    Scene {
        seconds: 12.0,
        ..Scene::new(15)
    }
    .record()
}

#[test]
fn recordings_that_do_not_meet_are_refused() {
    let mut record = short();
    record
        .imu
        .stamps
        .iter_mut()
        .for_each(|stamp| *stamp = stamp.plus_seconds(1e4));
    // A clock that is off by hours may still be aligned by the motion; a reference of another
    // motion may not.
    record.reference = Scene {
        seconds: 2.0,
        ..Scene::new(16)
    }
    .record()
    .reference;
    let error = refusal(&record);
    assert!(matches!(error, GapError::NoOverlap { .. }), "{error}");
    assert!(error.to_string().contains("wrist"));
}

#[test]
fn too_few_messages_are_refused() {
    let mut record = short();
    record.imu.stamps.truncate(49);
    record.imu.readings.truncate(49);
    assert!(matches!(
        refusal(&record),
        GapError::TooFewMessages {
            messages: 49,
            needed: 50,
            ..
        }
    ));
    let empty = PlacementRecord {
        imu: Default::default(),
        ..short()
    };
    assert!(matches!(
        refusal(&empty),
        GapError::TooFewMessages { messages: 0, .. }
    ));
    let mut blind = short();
    blind.reference = Default::default();
    assert!(matches!(refusal(&blind), GapError::Reference { .. }));
}

#[test]
fn readings_that_are_no_numbers_are_refused_or_left_out() {
    let mut record = short();
    record
        .imu
        .readings
        .iter_mut()
        .for_each(|reading| reading.specific_force.x = f64::NAN);
    assert!(matches!(refusal(&record), GapError::NotFinite { .. }));
    let mut record = Scene::new(17).record();
    record
        .imu
        .readings
        .iter_mut()
        .step_by(700)
        .for_each(|reading| reading.angular_velocity.y = f64::INFINITY);
    let diagnosis = answer(&record).diagnosis;
    let other: Vec<&str> = names(&diagnosis)
        .into_iter()
        .filter(|name| *name != "dropped_samples")
        .collect();
    assert_eq!(other, [""; 0], "{}", diagnosis.verdict);
    assert!(
        diagnosis.gap.after.accel_rmse.is_finite()
            && diagnosis.gap.after.nll_per_sample.is_finite()
    );
}

#[test]
fn a_stuck_sensor_is_refused() {
    let mut record = short();
    record
        .imu
        .readings
        .iter_mut()
        .for_each(|reading| reading.angular_velocity = Vector3::new(0.01, -0.02, 0.0));
    let error = refusal(&record);
    assert!(
        matches!(error, GapError::Stuck { .. })
            && error
                .to_string()
                .contains("gyro_x, gyro_y, gyro_z never change"),
        "{error}"
    );
}

#[test]
fn an_axis_whose_motion_is_rounded_away_is_no_stuck_one() {
    // Steps of 4 degrees a second, about the one axis that turns.
    let scene = Scene {
        motion: Motion::pendulum(),
        ..Scene::new(15).with(K::GyroQuantization, &[0.07])
    };
    let record = scene.record();
    let turns_about_y_alone = |rate: &Vector3<f64>| rate.x == 0.0 && rate.z == 0.0;
    let mut readings = record.imu.readings.iter();
    assert!(readings.all(|reading| turns_about_y_alone(&reading.angular_velocity)));
    let diagnosis = answer(&record).diagnosis;
    assert_eq!(
        names(&diagnosis),
        ["gyro_quantization"],
        "{}",
        diagnosis.verdict
    );
    // One that stands still while the motion turns about it is.
    let mut record = Scene::new(15).with(K::GyroQuantization, &[0.07]).record();
    for reading in &mut record.imu.readings {
        reading.angular_velocity.z = 0.0;
    }
    let error = refusal(&record).to_string();
    assert!(error.contains("wrist: gyro_z never change"), "{error}");
}

#[test]
fn the_order_of_messages_does_not_matter() {
    let record = lever_and_bias(18).record();
    let mut shuffled = record.clone();
    // Bursts arrive in turned order, and one twice.
    for (stamps, readings) in shuffled
        .imu
        .stamps
        .chunks_mut(50)
        .zip(shuffled.imu.readings.chunks_mut(50))
        .skip(1)
    {
        stamps.reverse();
        readings.reverse();
    }
    shuffled.imu.stamps.push(record.imu.stamps[77]);
    shuffled.imu.readings.push(record.imu.readings[77]);
    assert!(answer(&record).diagnosis == answer(&shuffled).diagnosis);
}

#[test]
fn effects_of_the_answer_are_the_causes() {
    let answer = answer(&lever_and_bias(19).record());
    let mut kinds: Vec<&str> = answer
        .effects
        .effects
        .iter()
        .map(|effect| effect.kind().name())
        .collect();
    kinds.sort_unstable();
    assert_eq!(kinds, names(&answer.diagnosis));
    assert!(answer.effects.effects != EffectSet::new());
    near(
        answer.effects.declared_noise.accel_density * IMU_HZ.sqrt(),
        SIGMA[0],
        1e-6,
        "declared noise",
    );
    assert_eq!(answer.effects.epoch, Scene::new(19).start);
}
