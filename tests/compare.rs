//! `cromosim compare` from the command line.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::{cromosim_in, succeed, text};

const DIAGNOSIS: &str = r#"{"schema": "cromosim/diagnosis/1", "placements": {"wrist": {"verdict": "",
    "gap": {"before": METRICS, "after": METRICS}, "where": {}, "unidentifiable": [], "unexplained": {"significant": false, "share": 0.1, "where": {}},
    "causes": [{"effect": "EFFECT", "probability": 0.9, "parameters": {"seconds": 0.02}, "standard_errors": {"seconds": 0.001}, "gap_share": 0.9, "after": METRICS}]}}}"#;
const METRICS: &str = r#"{"accel_rmse": 1.2, "gyro_rmse": 0.1, "accel_log_spectral_distance_db": 3.0, "gyro_log_spectral_distance_db": 1.0,
    "accel_wasserstein": 0.4, "gyro_wasserstein": 0.02, "nll_per_sample": 9.1}"#;

#[test]
fn recordings_are_compared_and_the_findings_written() {
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &["simulate", "--walk", "--seed", "1", "--out", "a.mcap"],
    );
    succeed(
        folder.path(),
        &["simulate", "--walk", "--seed", "2", "--out", "b.mcap"],
    );
    let said = succeed(
        folder.path(),
        &["compare", "a.mcap", "b.mcap", "--out", "found.json"],
    );
    assert!(
        said.contains("left_wrist") && said.contains("rate, Hz") && said.contains("100.00"),
        "{said}"
    );
    let found: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("found.json")).unwrap())
            .unwrap();
    let head = &found["placements"]["head"];
    assert_eq!(head["a"]["dropped"], 0);
    assert!(
        head["overlap"]["lag_s"].as_f64().unwrap().abs() < 1e-3,
        "{head}"
    );
    assert!(
        head["channels"]["accel"]["wasserstein"].as_f64().unwrap() < 0.05,
        "{head}"
    );
}

#[test]
fn diagnoses_are_compared_and_mistakes_named_on_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, effect: &str| {
        fs::write(
            folder.path().join(name),
            DIAGNOSIS
                .replace("METRICS", METRICS)
                .replace("EFFECT", effect),
        )
        .unwrap();
    };
    fs::create_dir(folder.path().join("old")).unwrap();
    write("old/diagnosis.json", "time_offset");
    write("new.json", "low_pass");
    let said = succeed(folder.path(), &["compare", "old", "new.json"]);
    assert!(
        said.contains("gone     time_offset (90 %): seconds 0.0200")
            && said.contains("new      low_pass"),
        "{said}"
    );
    succeed(folder.path(), &["simulate", "--walk", "--out", "a.mcap"]);
    fs::write(
        folder.path().join("wrong.json"),
        DIAGNOSIS
            .replace("METRICS", METRICS)
            .replace("diagnosis/1", "diagnosis/9"),
    )
    .unwrap();
    for (other, expected) in [
        ("a.mcap", "two of a kind"),
        ("none.json", "cannot be read"),
        ("wrong.json", "expected the schema 'cromosim/diagnosis/1'"),
    ] {
        let output = cromosim_in(folder.path(), &["compare", "new.json", other]);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(2), "{other}: {said}");
        let error = said.lines().last().unwrap();
        assert!(
            error.starts_with("error: ") && error.contains(expected),
            "{other}: {said}"
        );
    }
}
