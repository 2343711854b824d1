//! `cromosim evaluate fidelity` on a motion and devices that the test makes.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{refuses, succeed};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{embedded_walk, write_bvh};

const PROTOCOL: &str = "\
schema: cromosim/fidelity/1
seed: 5
studies:
  - name: walk, 60 Hz
    measured: drawn
    model: MODEL
    test:
      - {subject: a, licence: own, motions: [walk.bvh], sites: [left_watch, right_instep], repeats: 2, rate_hz: 60}
    mapping:
      - {subject: b, licence: own, motions: [walk.bvh], sites: [left_watch, right_instep], rate_hz: 60}
";

fn prepare(folder: &Path, model: &str) {
    let motion = embedded_walk().slice(1.0, Some(6.0)).unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap();
    fs::write(folder.join("walk.bvh"), write_bvh(&motion, &body)).unwrap();
    fs::write(
        folder.join("protocol.yaml"),
        PROTOCOL.replace("MODEL", model),
    )
    .unwrap();
}

fn rmse(results: &serde_json::Value, position: &str, simulator: &str) -> [f64; 2] {
    let positions = results["studies"][0]["positions"].as_array().unwrap();
    let own = positions
        .iter()
        .find(|own| own["position"] == position)
        .unwrap();
    let own = own["simulators"]
        .as_array()
        .unwrap()
        .iter()
        .find(|own| own["simulator"] == simulator)
        .unwrap();
    [0, 1].map(|which| own["rmse"][which].as_f64().unwrap())
}

#[test]
fn simulators_are_compared_and_the_same_again_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here, "motion_capture");
    let command = |out| {
        [
            "evaluate",
            "fidelity",
            "--protocol",
            "protocol.yaml",
            "--data",
            ".",
            "--out",
            out,
        ]
    };
    let said = succeed(here, &command("one"));
    assert!(
        said.contains("| left watch (2 recordings") && said.contains("learned, mapped"),
        "{said}"
    );
    // Truth that the spline made does not rank it, and every row says so.
    assert!(
        said.contains("| walk, 60 Hz | our spline of the clip † |")
            && said.contains("| spline † |")
            && said.contains("| adaptive_spline |")
            && said.contains("† The measured side was made by `spline`"),
        "{said}"
    );
    let results: serde_json::Value =
        serde_json::from_slice(&fs::read(here.join("one/results.json")).unwrap()).unwrap();
    for position in ["left_watch", "right_instep", "all"] {
        let [analytic, spline] =
            ["analytic", "spline"].map(|simulator| rmse(&results, position, simulator));
        // Frames of motion capture scatter, and a scheme that does not smooth shows it.
        assert!(
            spline[0] < 0.8 * analytic[0],
            "{position}: {spline:?} {analytic:?}"
        );
        // What `simulate` runs by default is judged too.
        let adaptive = rmse(&results, position, "adaptive_spline");
        assert!(
            adaptive[0] < 0.8 * analytic[0] && adaptive != spline,
            "{position}: {adaptive:?} {analytic:?}"
        );
    }
    // The forearm's skin turns nearly as its joint does, but lies away from it.
    let [analytic, joint] =
        ["analytic", "joint"].map(|simulator| rmse(&results, "left_watch", simulator));
    assert!(
        (joint[1] / analytic[1] - 1.0).abs() < 0.5 && joint[0] != analytic[0],
        "{joint:?} {analytic:?}"
    );
    for picture in [
        "walk__60_Hz_specific_force.png",
        "walk__60_Hz_angular_velocity.png",
    ] {
        assert!(
            fs::read(here.join("one").join(picture))
                .unwrap()
                .starts_with(b"\x89PNG")
        );
    }
    succeed(here, &command("two"));
    for name in [
        "results.json",
        "tables.md",
        "report.html",
        "walk__60_Hz_specific_force.png",
    ] {
        assert!(
            fs::read(here.join("one").join(name)).unwrap()
                == fs::read(here.join("two").join(name)).unwrap(),
            "{name} differs"
        );
    }
    refuses(here, &command("one"), &["one/results.json", "--force"]);
    let quick = succeed(here, &[&command("quick")[..], &["--quick"]].concat());
    assert!(quick.contains("| left watch (1 recordings"), "{quick}");
}

#[test]
fn what_cannot_be_compared_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here, "nobodys");
    let command = [
        "evaluate",
        "fidelity",
        "--protocol",
        "protocol.yaml",
        "--data",
        ".",
        "--out",
        "out",
    ];
    refuses(
        here,
        &command,
        &[
            "nobodys",
            "motion_capture, motion_capture_60, streaming, streaming_video, video",
        ],
    );
    refuses(
        here,
        &[&command[..], &["--models", "models"]].concat(),
        &["models/nobodys/acceleration.safetensors"],
    );
    for (from, to, expected) in [
        ("walk.bvh", "gone.bvh", "gone.bvh"),
        ("left_watch", "left_wing", "left_wing"),
        ("rate_hz: 60", "rate_hz: 0", "rate_hz 0"),
        ("fidelity/1", "fidelity/9", "cromosim/fidelity/1"),
        ("seed", "sead", "sead"),
    ] {
        fs::write(
            here.join("protocol.yaml"),
            PROTOCOL.replace("MODEL", "none").replace(from, to),
        )
        .unwrap();
        refuses(here, &command, &[expected]);
    }
    assert!(!here.join("out").exists());
}

#[test]
fn models_that_come_with_the_suite_simulate() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here, "none");
    for model in [
        "motion_capture",
        "motion_capture_60",
        "video",
        "streaming",
        "streaming_video",
    ] {
        let said = succeed(
            here,
            &[
                "simulate",
                "walk.bvh",
                "--learned",
                model,
                "--out",
                &format!("{model}.mcap"),
            ],
        );
        assert!(said.contains("messages"), "{said}");
    }
    refuses(
        here,
        &[
            "simulate",
            "walk.bvh",
            "--learned",
            "moton_capture",
            "--out",
            "x.mcap",
        ],
        &["moton_capture", "streaming"],
    );
}

#[test]
fn models_that_come_with_the_suite_are_worth_what_their_evaluation_says() {
    let Some(data) = common::shared_data() else {
        return;
    };
    let data = data.display().to_string();
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &[
            "evaluate", "fidelity", "--quick", "--data", &data, "--out", "out",
        ],
    );
    let results: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("out/results.json")).unwrap()).unwrap();
    let of = |study: usize, simulator: &str| {
        let position = results["studies"][study]["positions"]
            .as_array()
            .unwrap()
            .last()
            .unwrap();
        let own = position["simulators"]
            .as_array()
            .unwrap()
            .iter()
            .find(|own| own["simulator"] == simulator)
            .unwrap();
        [0, 1].map(|which| own["rmse"][which].as_f64().unwrap())
    };
    // Motion capture of 60 Hz and video: people and positions that the networks have not seen.
    for (study, least) in [(0, 0.2), (2, 0.05)] {
        let (spline, learned) = (of(study, "spline"), of(study, "learned"));
        assert!(
            learned[1] < (1.0 - least) * spline[1],
            "study {study}: {learned:?}, spline {spline:?}"
        );
    }
    // A real device whose other trials were learned from.
    assert!(of(4, "learned")[0] < 0.7 * of(4, "spline")[0]);
    // Nothing says more than networks that know what was measured.
    for study in 0..8 {
        assert!(of(study, "perfect")[0] <= of(study, "learned")[0]);
    }
}

const RIGID: &str = "\
schema: cromosim/fidelity/1
seed: 5
studies: []
rigid:
  - {name: markers, measured: physics, physics: {errors: markers, rate_hz: 120, picture: {motion: jump, position: pelvis, seconds: [2.1, 3.3]}}}
  - {name: suit, measured: physics, physics: {errors: inertial_suit, rate_hz: 60}}
  - {name: closed form, measured: known, analytic: {errors: markers, rate_hz: 60}}
  - {name: real, measured: nobody, recordings: [\"none/*.npz\"], optional: true}
";

const RIGID_COMMAND: [&str; 6] = [
    "evaluate",
    "fidelity",
    "--protocol",
    "protocol.yaml",
    "--data",
    ".",
];

#[test]
fn rigid_bodies_are_compared_with_known_readings_and_the_practice() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("protocol.yaml"), RIGID).unwrap();
    let said = succeed(here, &[&RIGID_COMMAND[..], &["--out", "one"]].concat());
    assert!(
        said.contains("practice, best in hindsight") && said.contains("real: skipped: "),
        "{said}"
    );
    let results: serde_json::Value =
        serde_json::from_slice(&fs::read(here.join("one/results.json")).unwrap()).unwrap();
    let studies = results["rigid"].as_array().unwrap();
    assert_eq!(studies.len(), 3);
    for (study, (truth, motions, bodies)) in studies.iter().zip([
        ("physics", 6, 36),
        ("physics", 6, 36),
        ("closed_form", 5, 30),
    ]) {
        assert_eq!(
            (&study["truth"], &study["motions"], &study["bodies"]),
            (&truth.into(), &motions.into(), &bodies.into())
        );
        let of = |name: &str, what: &str| {
            let methods = study["methods"].as_array().unwrap();
            let own = methods.iter().find(|own| own["method"] == name).unwrap();
            [0, 1].map(|channel| own[what][channel].as_f64().unwrap())
        };
        // Differences of poses that scatter are mostly noise; no cutoff is better than the best.
        assert!(of("richardson", "rmse")[0] > 1.5 * of("adaptive_spline", "rmse")[0]);
        assert!(
            of("practice, 6 Hz", "ratio")
                .iter()
                .all(|ratio| *ratio >= 1.0)
        );
        // The estimate that follows the motion does not know the best cutoff, but needs it less.
        let ratio = of("adaptive_spline", "ratio");
        assert!(ratio[0] < 1.05 && ratio[1] < 1.0, "{study}");
        assert!(study["stated"]["middle"][0].as_f64().unwrap() > 0.0);
    }
    assert!(here.join("one/rigid_angular_velocity.png").exists());
    assert!(
        here.join("one/markers_jump_pelvis_angular_velocity.png")
            .exists()
    );
    succeed(here, &[&RIGID_COMMAND[..], &["--out", "two"]].concat());
    for name in [
        "results.json",
        "tables.md",
        "report.html",
        "markers_jump_pelvis_specific_force.png",
    ] {
        assert!(
            fs::read(here.join("one").join(name)).unwrap()
                == fs::read(here.join("two").join(name)).unwrap(),
            "{name} differs"
        );
    }
    let quick = succeed(
        here,
        &[&RIGID_COMMAND[..], &["--out", "quick", "--quick"]].concat(),
    );
    assert!(quick.contains("6 motions, 6 IMUs"), "{quick}");
}

#[test]
fn rigid_studies_that_cannot_be_run_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let command = [&RIGID_COMMAND[..], &["--out", "out"]].concat();
    for (from, to, expected) in [
        ("rate_hz: 120", "rate_hz: 100", "rate_hz 100"),
        ("rate_hz: 120", "rate_hz: 1", "study markers: rate_hz 1"),
        ("errors: markers", "errors: magic", "magic"),
        ("position: pelvis", "position: tail", "\"tail\""),
        (
            "analytic: {errors: markers, rate_hz: 60}",
            "analytic: {errors: vibe, rate_hz: 30}",
            "study closed form: errors Vibe: drawn on a body",
        ),
        (
            "analytic: {errors: markers, rate_hz: 60}",
            "analytic: {errors: markers, rate_hz: 70}",
            "rate_hz 70",
        ),
        (
            "analytic: {errors: markers, rate_hz: 60}",
            "analytic: {errors: markers, rate_hz: 60}, recordings: [a]",
            "expected only one of",
        ),
        (
            "physics: {errors: inertial_suit, rate_hz: 60}",
            "recordings: []",
            "study suit",
        ),
        (", optional: true", "", "none"),
    ] {
        fs::write(here.join("protocol.yaml"), RIGID.replace(from, to)).unwrap();
        refuses(here, &command, &[expected]);
    }
    assert!(!here.join("out").exists());
}

#[test]
fn real_imus_on_rigid_bodies_are_compared() {
    let Some(data) = common::shared_data() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let real = "schema: cromosim/fidelity/1\nseed: 5\nstudies: []\nrigid:\n  \
                - {name: real, measured: BROAD, recordings: [\"paired_broad/*.npz\"]}\n";
    fs::write(here.join("protocol.yaml"), real).unwrap();
    let data = data.display().to_string();
    let protocol = ["--protocol", "protocol.yaml", "--quick", "--data", &data];
    let said = succeed(
        here,
        &[&["evaluate", "fidelity", "--out", "out"], &protocol[..]].concat(),
    );
    assert!(said.contains("2 motions, 2 IMUs"), "{said}");
    let results: serde_json::Value =
        serde_json::from_slice(&fs::read(here.join("out/results.json")).unwrap()).unwrap();
    // A clock, mount or lever arm that is not found leaves metres per second squared.
    let rmse = &results["rigid"][0]["practice"]["rmse"];
    assert!(
        rmse[0].as_f64().unwrap() < 0.5 && rmse[1].as_f64().unwrap() < 0.1,
        "{rmse}"
    );
}
