//! The demo, its bag, and what foreign programs make of it.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use cromosim_bag::BagReader;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::testing::{environment, in_private_network};

use crate::common::{CROMOSIM, python, root, skipped, text};

fn demo(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(CROMOSIM);
    let output = command
        .arg("demo")
        .args(arguments)
        .current_dir(folder)
        .envs(environment())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    text(&output)
}

#[test]
fn the_demo_makes_a_bag_and_a_recording() {
    in_private_network("demo::the_demo_makes_a_bag_and_a_recording", || {
        let folder = tempfile::tempdir().unwrap();
        // A foreign subscriber beside the suite's own nodes.
        let listener = python().map(|python| {
            let topics = ["left_wrist", "right_ankle", "pelvis", "sternum", "head"]
                .map(|name| format!("/imu/{name}/data_raw"));
            let out = fs::File::create(folder.path().join("cyclone.json")).unwrap();
            let mut command = Command::new(python);
            command
                .arg(root().join("tests/interop/cyclone_listener.py"))
                .args(["--timeout", "120"])
                .args(topics);
            command
                .envs(environment())
                .stdout(out)
                .stderr(Stdio::inherit())
                .spawn()
                .unwrap()
        });
        let mut extra: Vec<&str> = vec![];
        if cfg!(not(feature = "view")) {
            extra.push("--no-viewer");
        }
        // Two subscriptions of the suite, and the foreign one where there is Python.
        let waits = listener.is_some().then_some(["--listeners", "1"]);
        extra.extend(waits.iter().flatten());
        let said = demo(folder.path(), &extra);
        println!("{said}");
        let out = folder.path().join("cromosim-demo");
        let reader = BagReader::open(&out.join("bag")).unwrap();
        let count = |topic: &str| {
            reader
                .summary()
                .topics
                .iter()
                .find(|counted| counted.topic.name == topic)
                .map_or(0, |counted| counted.message_count)
        };
        let poses = count("/smpl/pose");
        assert_eq!(poses, count("/smpl/state"), "every pose becomes a state");
        assert!(poses >= 1000, "10 s at 100 Hz or more: {poses}");
        for name in ["left_wrist", "right_ankle", "pelvis", "sternum", "head"] {
            let imus = reader
                .read::<Imu>(&format!("/imu/{name}/data_raw"))
                .unwrap();
            // 10 s at 100 Hz, less the delay of the scheme at the end.
            assert!((960..=1002).contains(&imus.len()), "{name}: {}", imus.len());
            for pair in imus.windows(2) {
                let interval = pair[1].1.header.stamp.nanos() - pair[0].1.header.stamp.nanos();
                assert!(
                    (interval - 10_000_000).abs() <= 2,
                    "{name}: stamps stand on a 100 Hz grid, {interval} ns"
                );
            }
            assert!(
                said.contains(&format!("/imu/{name}/data_raw")),
                "the summary names every topic"
            );
        }
        assert!(
            reader.attachment("placements.yaml").is_some(),
            "the recorder keeps the placements"
        );
        assert!(reader.metadata("cromosim").is_some());
        if let (Some(python), Some(listener)) = (python(), listener) {
            check_foreign_readers(
                &python,
                &out,
                listener,
                &folder.path().join("cyclone.json"),
                &reader,
            );
        }
    });
}

fn check_foreign_readers(
    python: &Path,
    out: &Path,
    mut listener: Child,
    report: &Path,
    reader: &BagReader,
) {
    assert!(
        Command::new("kill")
            .args(["-INT", &listener.id().to_string()])
            .status()
            .unwrap()
            .success()
    );
    assert!(
        listener.wait().unwrap().success(),
        "the CycloneDDS subscriber failed"
    );
    let report: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(report).unwrap()).unwrap();
    for name in ["left_wrist", "right_ankle", "pelvis", "sternum", "head"] {
        let topic = format!("/imu/{name}/data_raw");
        let recorded = reader.read::<Imu>(&topic).unwrap().len() as u64;
        let received = report["topics"][&topic]["messages"].as_u64().unwrap();
        assert_eq!(
            received, recorded,
            "{topic}: CycloneDDS receives every message: {report}"
        );
        assert_eq!(
            report["topics"][&topic]["nodes"],
            serde_json::json!(["/virtual_imu"]),
            "node names resolve: {report}"
        );
    }
    let bag = out.join("bag");
    let output = Command::new(python)
        .arg(root().join("tests/interop/check_bag.py"))
        .arg(&bag)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    let Some(rerun) = std::env::var_os("CROMOSIM_RERUN") else {
        return skipped("CROMOSIM_RERUN names no rerun program");
    };
    if cfg!(feature = "view") {
        let output = Command::new(rerun)
            .args(["rrd", "verify"])
            .arg(out.join("demo.rrd"))
            .env("RERUN_ANALYTICS", "false")
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", text(&output));
    }
}

#[test]
fn the_demo_says_where_poses_come_from() {
    in_private_network("demo::the_demo_says_where_poses_come_from", || {
        let folder = tempfile::tempdir().unwrap();
        let amass = root().join("nodes/lib/motion/tests/data/poses/chain_amass.npz");
        demo(
            folder.path(),
            &["--motion", amass.to_str().unwrap(), "--no-viewer"],
        );
        let log = |node: &str| {
            let path = folder.path().join(format!("cromosim-demo/logs/{node}.log"));
            fs::read_to_string(path).unwrap()
        };
        let (imu, replay) = (log("virtual_imu"), log("replay"));
        assert!(imu.contains("adaptive_spline of fitted poses"), "{imu}");
        assert!(replay.contains("pose_source:=fitted"), "{replay}");
    });
}
