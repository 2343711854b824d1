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
        let (said, heard) = heard_demo(folder.path());
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
        for name in PLACEMENTS {
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
        if let (Some(python), Some(heard)) = (python(), heard) {
            check_listener(&heard, &reader);
            check_foreign_readers(&python, &out);
        }
    });
}

const PLACEMENTS: [&str; 5] = ["left_wrist", "right_ankle", "pelvis", "sternum", "head"];

/// The demo, and beside the suite's own nodes a foreign subscriber, where there is Python: what the
/// one said and the other heard.
fn heard_demo(folder: &Path) -> (String, Option<serde_json::Value>) {
    let report = folder.join("cyclone.json");
    let listener = python().map(|python| {
        let mut command = Command::new(python);
        command
            .arg(root().join("tests/interop/cyclone_listener.py"))
            .args(["--timeout", "120"])
            .args(PLACEMENTS.map(|name| format!("/imu/{name}/data_raw")))
            .envs(environment())
            .stdout(fs::File::create(&report).unwrap())
            .stderr(Stdio::inherit());
        command.spawn().unwrap()
    });
    let mut extra: Vec<&str> = vec![];
    if cfg!(not(feature = "view")) {
        extra.push("--no-viewer");
    }
    // Two subscriptions of the suite, and the foreign one where there is Python.
    let waits = listener.is_some().then_some(["--listeners", "1"]);
    extra.extend(waits.iter().flatten());
    let said = demo(folder, &extra);
    let heard = listener.map(|listener| {
        end(listener);
        serde_json::from_str(&fs::read_to_string(&report).unwrap()).unwrap()
    });
    (said, heard)
}

fn end(mut listener: Child) {
    let id = listener.id().to_string();
    let told = Command::new("kill").args(["-INT", &id]).status();
    assert!(told.unwrap().success());
    assert!(
        listener.wait().unwrap().success(),
        "the CycloneDDS subscriber failed"
    );
}

/// The topics of which the foreign subscriber has not what is recorded.
fn missed(heard: &serde_json::Value, reader: &BagReader) -> Vec<String> {
    let topics = PLACEMENTS.map(|name| format!("/imu/{name}/data_raw"));
    let is_missed = |topic: &String| {
        let recorded = reader.read::<Imu>(topic).unwrap().len() as u64;
        heard["topics"][topic]["messages"].as_u64() != Some(recorded)
    };
    topics.into_iter().filter(is_missed).collect()
}

/// CycloneDDS receives every message, under names that resolve. One message in 5000 was lost to it
/// once, on a busy machine, and in none of more than thirty demos since; the second demo is not
/// let off.
fn check_listener(heard: &serde_json::Value, reader: &BagReader) {
    for name in PLACEMENTS {
        assert_eq!(
            heard["topics"][format!("/imu/{name}/data_raw")]["nodes"],
            serde_json::json!(["/virtual_imu"]),
            "node names resolve: {heard}"
        );
    }
    if missed(heard, reader).is_empty() {
        return;
    }
    println!("CycloneDDS missed messages, once more: {heard}");
    let folder = tempfile::tempdir().unwrap();
    let (_, heard) = heard_demo(folder.path());
    let heard = heard.expect("there is Python");
    let reader = BagReader::open(&folder.path().join("cromosim-demo/bag")).unwrap();
    assert_eq!(
        missed(&heard, &reader),
        Vec::<String>::new(),
        "CycloneDDS receives every message: {heard}"
    );
}

fn check_foreign_readers(python: &Path, out: &Path) {
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
