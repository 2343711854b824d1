//! Several recordings of one device, and the calibrations that are kept without being causes.
#![allow(clippy::unwrap_used)]

mod support;

use cromosim_gap::{
    DiagnoseOptions, PlacementAnswer, PlacementRecord, RecordingDiagnosis, diagnose_together,
};
use cromosim_imu::EffectKind as K;
use serde_json::{Value, json};
use support::Scene;
use support::judge::{answer, names, shares_add_up};

fn together(first: &PlacementRecord, second: &PlacementRecord) -> PlacementAnswer {
    let recordings = [("first", first), ("second", second)];
    let (answer, errors) = diagnose_together(&recordings, &DiagnoseOptions::default()).unwrap();
    assert!(errors.is_empty(), "{errors:?}");
    answer
}

/// A parameter of an effect in one recording.
fn value<'a>(recording: &'a RecordingDiagnosis, effect: &str, parameter: &str) -> &'a Value {
    let mut causes = recording.causes.iter();
    let cause = causes.find(|cause| cause.effect == effect).unwrap();
    &cause.parameters[parameter]
}

#[test]
fn the_device_is_shared_and_the_sessions_are_not() {
    let scene = |seed, seconds| Scene {
        seconds,
        ..Scene::new(seed).with(K::LeverArm, &[0.05, 0.02, -0.06])
    };
    let first = scene(81, 30.0).with(K::TimeOffset, &[0.021]);
    let mut second = scene(82, 25.0).with(K::TimeOffset, &[-0.034]);
    second.start = second.start.plus_seconds(5000.0);
    second.epoch = second.start;
    let PlacementAnswer {
        diagnosis, effects, ..
    } = together(&first.record(), &second.record());

    assert_eq!(
        names(&diagnosis),
        ["lever_arm", "time_offset"],
        "{}",
        diagnosis.verdict
    );
    shares_add_up(&diagnosis);
    let [of_first, of_second] = diagnosis.recordings.as_slice() else {
        panic!("two recordings: {:?}", diagnosis.recordings);
    };
    assert_eq!(
        (of_first.recording.as_str(), of_second.recording.as_str()),
        ("first", "second")
    );
    let arms = [of_first, of_second].map(|one| value(one, "lever_arm", "offset"));
    assert_eq!(arms[0], arms[1], "one device, one lever arm");
    for (one, seconds) in [(of_first, 0.021), (of_second, -0.034)] {
        let found = value(one, "time_offset", "seconds").as_f64().unwrap();
        assert!((found - seconds).abs() < 5e-4, "{}: {found}", one.recording);
        let (before, after) = (one.gap.before.accel_rmse, one.left_out.accel_rmse);
        assert!(
            after < 0.2 * before && after < 1.1 * one.gap.after.accel_rmse,
            "the lever arm of the other recording serves {}: {before} to {after}, by itself {}",
            one.recording,
            one.gap.after.accel_rmse
        );
    }

    // What is told of the device as a whole, and what is written for simulations.
    assert_eq!(
        effects.epoch, second.start,
        "effects.yaml is of the last recording"
    );
    assert_eq!(
        effects.effects.time_offset(),
        value(of_second, "time_offset", "seconds").as_f64().unwrap()
    );
    let of_session = effects.in_session_of(first.start.plus_seconds(100.0));
    assert_eq!(
        of_session.effects.time_offset(),
        value(of_first, "time_offset", "seconds").as_f64().unwrap()
    );
    assert_eq!(of_session.effects.lever_arm(), effects.effects.lever_arm());
}

#[test]
fn recordings_without_effects_name_none() {
    let (first, second) = (Scene::new(83), Scene::new(84));
    let diagnosis = together(&first.record(), &second.record()).diagnosis;
    assert!(names(&diagnosis).is_empty(), "{}", diagnosis.verdict);
    assert_eq!(diagnosis.recordings.len(), 2);
}

#[test]
fn a_recording_with_nothing_to_compare_is_left_out_by_name() {
    let good = Scene::new(85).with(K::AccelBias, &[0.3, 0.0, 0.1]).record();
    let mut short = Scene::new(86).record();
    short.imu.stamps.truncate(10);
    short.imu.readings.truncate(10);
    let recordings = [("short", &short), ("good", &good)];
    let (answer, errors) = diagnose_together(&recordings, &DiagnoseOptions::default()).unwrap();
    assert_eq!(names(&answer.diagnosis), ["accel_bias"]);
    let [(name, error)] = errors.as_slice() else {
        panic!("one error: {errors:?}");
    };
    assert_eq!(*name, "short");
    assert!(error.to_string().contains("wrist"), "{error}");
    let alone = diagnose_together(&recordings[..1], &DiagnoseOptions::default());
    assert_eq!(alone.unwrap_err().0, "short");
}

/// Up to two milliseconds are what every recording has, and no cause; a simulation does better with it.
#[test]
fn an_ordinary_delay_is_kept_without_being_a_cause() {
    let scene = Scene::new(87).with(K::TimeOffset, &[0.0016]);
    let PlacementAnswer {
        diagnosis, effects, ..
    } = answer(&scene.record());
    assert!(names(&diagnosis).is_empty(), "{}", diagnosis.verdict);
    let kept: Vec<&str> = diagnosis
        .calibration
        .iter()
        .map(|kept| kept.effect.as_str())
        .collect();
    assert_eq!(kept, ["time_offset"]);
    let found = effects.effects.time_offset();
    assert!((found - 0.0016).abs() < 2e-4, "{found}");
    assert_eq!(diagnosis.calibration[0].parameters["seconds"], json!(found));
    assert!(diagnosis.gap.after.accel_rmse < 0.99 * diagnosis.gap.before.accel_rmse);
}
