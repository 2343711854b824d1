//! Hidden effects are found, on the placement that has them.

use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

use crate::answer::{causes, contract, diagnosis, promise_holds, set};
use crate::common::{CROMOSIM, succeed, text};
use crate::session::record;

pub const LEVER_ARM: &str = "{effect: lever_arm, offset: [0.05, 0.01, -0.06]}";

const LATE_AND_BIASED: &str =
    "{effect: time_offset, seconds: 0.021}, {effect: accel_bias, bias: [0.3, -0.2, 0.25]}";

#[test]
fn a_lever_arm_is_found_and_the_promise_holds() {
    let folder = tempfile::tempdir().unwrap();
    let placements = [("wrist", LEVER_ARM)];
    record(folder.path(), "fit.mcap", 1, (0.0, 60.0), &placements);
    record(folder.path(), "check.mcap", 1, (90.0, 30.0), &placements);
    let said = succeed(folder.path(), &["diagnose", "fit.mcap", "--out", "found"]);
    assert!(
        said.contains("wrist: ") && said.contains("lever_arm") && said.contains("probability"),
        "{said}"
    );
    let found = diagnosis(folder.path(), "found");
    assert_eq!(causes(&found, "wrist"), set(&["lever_arm"]), "{said}");
    let offset = &found["placements"]["wrist"]["causes"][0]["parameters"]["offset"];
    for (axis, expected) in [0.05, 0.01, -0.06].into_iter().enumerate() {
        assert!(
            (offset[axis].as_f64().unwrap() - expected).abs() < 1e-3,
            "{offset}"
        );
    }
    let files = [
        "diagnosis.json",
        "effects.yaml",
        "report.html",
        "diagnosis.rrd",
    ];
    let expected = if cfg!(feature = "view") {
        set(&files)
    } else {
        set(&files[..3])
    };
    let there = fs::read_dir(folder.path().join("found"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap());
    assert_eq!(there.collect::<BTreeSet<_>>(), expected);
    promise_holds(folder.path(), "found", "check.mcap", "wrist");

    // Without its cause in the library, the gap is still there, and lever_arm nowhere.
    let said = succeed(
        folder.path(),
        &[
            "diagnose",
            "fit.mcap",
            "--out",
            "found",
            "--without",
            "lever_arm",
            "--force",
        ],
    );
    let without = diagnosis(folder.path(), "found");
    assert!(!causes(&without, "wrist").contains("lever_arm"), "{said}");
    // The detection of what is outside the library decides here; see nodes/lib/gap/src/unknown.rs.
    assert!(causes(&without, "wrist").contains("unknown"), "{said}");
    assert!(
        !fs::read_to_string(folder.path().join("found/effects.yaml"))
            .unwrap()
            .contains("unknown")
    );
}

#[test]
fn two_causes_are_found_on_one_of_two_placements_and_the_answer_is_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let placements = [("wrist", LATE_AND_BIASED), ("ankle", "")];
    record(folder.path(), "fit.mcap", 2, (0.0, 60.0), &placements);
    record(folder.path(), "check.mcap", 2, (80.0, 40.0), &placements);
    let run = |threads: &str, out: &str| {
        let mut command = Command::new(CROMOSIM);
        command
            .args(["diagnose", "fit.mcap", "--out", out, "--seed", "3"])
            .current_dir(folder.path())
            .env("RAYON_NUM_THREADS", threads);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", text(&output));
    };
    run("1", "one");
    run("4", "four");
    for name in ["diagnosis.json", "effects.yaml", "report.html"] {
        let read = |out: &str| fs::read(folder.path().join(out).join(name)).unwrap();
        assert!(
            read("one") == read("four"),
            "{name} is another with other threads"
        );
    }
    let found = diagnosis(folder.path(), "one");
    assert_eq!(causes(&found, "wrist"), set(&["time_offset", "accel_bias"]));
    assert_eq!(causes(&found, "ankle"), set(&[]));
    contract(&found);
    promise_holds(folder.path(), "one", "check.mcap", "wrist");
    promise_holds(folder.path(), "one", "check.mcap", "ankle");

    fs::write(
        folder.path().join("only.yaml"),
        "placements: [ankle]\nseed: 3\n",
    )
    .unwrap();
    succeed(
        folder.path(),
        &[
            "diagnose",
            "fit.mcap",
            "--out",
            "only",
            "--config",
            "only.yaml",
        ],
    );
    let only = diagnosis(folder.path(), "only");
    assert_eq!(only["placements"].as_object().unwrap().len(), 1);
    assert_eq!(only["placements"]["ankle"], found["placements"]["ankle"]);
}

/// Two sessions of one device: its lever arm is in both, each has a clock of its own, and a later
/// recording is simulated with its session's.
#[test]
fn two_recordings_are_diagnosed_together() {
    let folder = tempfile::tempdir().unwrap();
    let late = |seconds: f64| format!("{LEVER_ARM}, {{effect: time_offset, seconds: {seconds}}}");
    let (first, second) = (late(0.02), late(-0.03));
    let of = |file: &str, seed, span, effects: &str| {
        record(folder.path(), file, seed, span, &[("wrist", effects)]);
    };
    of("first.mcap", 1, (0.0, 40.0), &first);
    of("check.mcap", 1, (50.0, 30.0), &first);
    of("second.mcap", 7, (5000.0, 40.0), &second);
    let files = ["first.mcap", "second.mcap"];
    let said = succeed(
        folder.path(),
        &["diagnose", files[0], files[1], "--out", "found"],
    );
    let found = diagnosis(folder.path(), "found");
    assert_eq!(
        causes(&found, "wrist"),
        set(&["lever_arm", "time_offset"]),
        "{said}"
    );
    let report = fs::read_to_string(folder.path().join("found/report.html")).unwrap();
    for (index, file) in files.into_iter().enumerate() {
        let one = &found["placements"]["wrist"]["recordings"][index];
        assert_eq!(one["recording"], file);
        assert!(said.contains(&format!("{file}: ")), "{said}");
        assert!(report.contains(&format!("<b>{file}</b>")));
    }
    promise_holds(folder.path(), "found", "check.mcap", "wrist");
}
