//! The Rerun recording of a diagnosis is one that Rerun takes.
#![cfg(feature = "view")]
#![allow(clippy::unwrap_used, missing_docs)]

mod common;
#[path = "../nodes/bin/cromosim/diagnose_view.rs"]
mod diagnose_view;

use std::collections::BTreeMap;
use std::process::Command;

use common::{skipped, text};
use cromosim_gap::{
    Cause, CoursePoint, Diagnosis, Evidence, Gap, GapLocation, Metrics, PlacementDiagnosis, SCHEMA,
    Spectra, Unexplained,
};
use cromosim_spatial::Stamp;
use serde_json::json;

fn diagnosis() -> Diagnosis {
    let after = Metrics {
        accel_rmse: 0.26,
        gyro_rmse: 0.02,
        ..Metrics::default()
    };
    let cause = |effect: &str, parameter: &str, value, share| Cause {
        effect: effect.to_owned(),
        probability: 0.97,
        probability_by_margin: 0.97,
        parameters: BTreeMap::from([(parameter.to_owned(), value)]),
        standard_errors: BTreeMap::new(),
        gap_share: share,
        after,
    };
    let placement = |verdict: &str| PlacementDiagnosis {
        recordings: Vec::new(),
        magnetometer: None,
        clock_jumps: Vec::new(),
        calibration: Vec::new(),
        reference_response: None,
        verdict: verdict.to_owned(),
        gap: Gap {
            before: Metrics {
                accel_rmse: 1.2,
                gyro_rmse: 0.1,
                ..Metrics::default()
            },
            after,
        },
        location: GapLocation {
            axes: BTreeMap::from([("accel_y".to_owned(), 0.8), ("gyro_z".to_owned(), 0.2)]),
            ..GapLocation::default()
        },
        causes: vec![
            cause(
                "lever_arm",
                "offset",
                json!([0.0503, 0.0004, -0.0612]),
                0.71,
            ),
            cause("time_offset", "seconds", json!(0.0211), 0.27),
        ],
        unidentifiable: Vec::new(),
        unexplained: Unexplained {
            share: 0.02,
            ..Unexplained::default()
        },
    };
    let quiet = PlacementDiagnosis {
        recordings: Vec::new(),
        magnetometer: None,
        clock_jumps: Vec::new(),
        calibration: Vec::new(),
        reference_response: None,
        causes: Vec::new(),
        ..placement("No gap beyond the declared noise.")
    };
    let placements = BTreeMap::from([
        (
            "left_wrist".to_owned(),
            placement(
                "The sensor sits 7.9 cm from where the simulation has it, and its stamps are 21 ms late.",
            ),
        ),
        ("head".to_owned(), quiet),
    ]);
    Diagnosis {
        schema: SCHEMA.to_owned(),
        placements,
    }
}

fn evidence() -> Evidence {
    let mut evidence = Evidence::default();
    for k in 0..3000 {
        let t = f64::from(k) * 0.01;
        let wave = |axis: usize, t: f64| {
            (if axis < 3 { 6.0 } else { 2.0 })
                * ((2.1 + axis as f64) * t + axis as f64).sin()
                * (0.7 * t).cos()
        };
        let jitter = |axis: usize| 0.1 * ((k * (axis as i32 + 7) * 7919) % 101) as f64 / 101.0;
        evidence.stamps.push(Stamp::from_seconds(1.7e9 + t));
        evidence.used.push(true);
        evidence
            .measured
            .push(std::array::from_fn(|axis| wave(axis, t) + jitter(axis)));
        evidence
            .before
            .push(std::array::from_fn(|axis| wave(axis, t + 0.1)));
        evidence
            .after
            .push(std::array::from_fn(|axis| wave(axis, t)));
    }
    let course = |k: i32| CoursePoint {
        seconds: f64::from(k) + 0.5,
        accel_before: 300.0 + 100.0 * f64::from(k % 7),
        accel_after: 1.0 + 0.05 * f64::from(k % 5),
        gyro_before: 30.0,
        gyro_after: 1.1,
    };
    evidence.course = (0..30).map(course).collect();
    let density = |hz: f64, level: f64| [level / (1.0 + (hz / 3.0).powi(4)) + 1e-4; 6];
    let frequencies: Vec<f64> = (0..=256).map(|k| f64::from(k) * 50.0 / 256.0).collect();
    let of = |level: f64| {
        frequencies
            .iter()
            .map(|hz| density(*hz, level))
            .collect::<Vec<_>>()
    };
    evidence.spectra = Spectra {
        measured: of(20.0),
        residual_before: of(2.0),
        residual_after: of(1e-5),
        predicted: of(0.0),
        frequencies,
    };
    evidence
}

#[test]
fn rerun_takes_the_recording_of_a_diagnosis() {
    let folder = tempfile::tempdir().unwrap();
    // CROMOSIM_DIAGNOSIS_RRD=FILE keeps it, to be looked at.
    let kept = std::env::var_os("CROMOSIM_DIAGNOSIS_RRD").map(std::path::PathBuf::from);
    let path = kept.unwrap_or_else(|| folder.path().join("diagnosis.rrd"));
    let evidence = BTreeMap::from([("left_wrist".to_owned(), evidence())]);
    diagnose_view::write_rrd(&path, &diagnosis(), &evidence).unwrap();
    assert!(path.metadata().unwrap().len() > 100_000);
    let Some(rerun) = std::env::var_os("CROMOSIM_RERUN") else {
        return skipped("CROMOSIM_RERUN names no rerun program");
    };
    let output = Command::new(rerun)
        .args(["rrd", "verify"])
        .arg(&path)
        .env("RERUN_ANALYTICS", "false")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
}
