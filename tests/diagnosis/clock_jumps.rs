//! Clocks that were set while they recorded.

use std::path::Path;
use std::process::Command;

use cromosim_bag::{BagOptions, BagWriter};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_spatial::Stamp;

use crate::answer::{causes, contract, diagnosis, set};
use crate::common::{CROMOSIM, succeed, text};
use crate::found::LEVER_ARM;
use crate::session::{Motion, Random, imus, record, reference, stamp};

const SECONDS: f64 = 60.0;

/// A bag whose messages came one after another, whatever their stamps say.
fn write_as_it_came(path: &Path, poses: &[PoseStamped], readings: &[Imu]) {
    let mut bag = BagWriter::create(path, BagOptions::default()).unwrap();
    let arrival = |index: usize, count: usize| stamp(SECONDS * index as f64 / count as f64);
    for (index, message) in poses.iter().enumerate() {
        let at = arrival(index, poses.len());
        bag.write("/reference/wrist", at, message).unwrap();
    }
    for (index, message) in readings.iter().enumerate() {
        let at = arrival(index, readings.len());
        bag.write("/imu/wrist/data_raw", at, message).unwrap();
    }
    bag.finish().unwrap();
}

/// A recording with a lever arm, as it would be without any jump.
fn sound(folder: &Path) -> (Vec<PoseStamped>, Vec<Imu>) {
    record(
        folder,
        "sound.mcap",
        4,
        (0.0, SECONDS),
        &[("wrist", LEVER_ARM)],
    );
    let poses = reference(&Motion::new(4), 0.0, SECONDS, (1e-4, 8e-4), &mut Random(9));
    (poses, imus(&folder.join("sound.mcap"), "wrist"))
}

/// Runs `cromosim` with 1.5 GB of address space, which hours without a message would not fit into.
fn succeed_in_little_memory(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new("sh")
        .args(["-c", "ulimit -v 1500000 && exec \"$@\"", "sh", CROMOSIM])
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", text(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// `simulate --reference` gives one message for each that was measured, with its stamp.
fn simulates_each_stamp(folder: &Path, file: &str, name: &str) {
    let again = format!("{name}_again.mcap");
    let effects = format!("{name}/effects.yaml");
    let arguments = ["simulate", "--reference", file, "--effects", &effects];
    succeed_in_little_memory(folder, &[&arguments[..], &["--out", &again]].concat());
    let stamps = |file: &str| {
        let messages = imus(&folder.join(file), "wrist").into_iter();
        let mut stamps: Vec<i64> = messages
            .map(|message| message.header.stamp.nanos())
            .collect();
        stamps.sort_unstable();
        stamps
    };
    assert_eq!(stamps(file), stamps(&again));
}

fn later(message: &mut Imu, seconds: f64) {
    let stamp = Stamp::from_nanos(message.header.stamp.nanos()).plus_seconds(seconds);
    message.header.stamp = cromosim_msgs::std_msgs::Header::new(stamp.nanos, "").stamp;
}

#[test]
fn an_imu_whose_clock_jumps_is_diagnosed_in_parts() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (poses, readings) = sound(here);
    for (name, by) in [("hour", 3600.0), ("day", 86400.0), ("back", -3600.0)] {
        let mut jumping = readings.clone();
        jumping[2500..]
            .iter_mut()
            .for_each(|message| later(message, by));
        // And a message that was never stamped.
        jumping[4000].header.stamp = Default::default();
        let file = format!("{name}.mcap");
        write_as_it_came(&here.join(&file), &poses, &jumping);
        let said = succeed_in_little_memory(here, &["diagnose", &file, "--out", name]);
        simulates_each_stamp(here, &file, name);
        let report = std::fs::read_to_string(here.join(name).join("report.html")).unwrap();
        assert!(report.contains("clock_jump") && report.contains("part 2"));
        assert!(
            said.contains("clock_jump") && said.contains("part 2"),
            "{said}"
        );
        let found = diagnosis(here, name);
        // What is said of any recording is said of this one; two keys are for several parts alone.
        let mut usual = found.clone();
        let wrist = usual["placements"]["wrist"].as_object_mut().unwrap();
        assert!(wrist.remove("clock_jumps").is_some() && wrist.remove("recordings").is_some());
        contract(&usual);
        assert_eq!(causes(&found, "wrist"), set(&["lever_arm"]), "{said}");
        let jumps = found["placements"]["wrist"]["clock_jumps"]
            .as_array()
            .unwrap();
        let near = |value: &serde_json::Value, expected: f64| {
            (value.as_f64().unwrap() - expected).abs() < 0.05
        };
        assert!(
            jumps[0]["clock"] == "imu" && jumps[0]["diagnosed"] == true,
            "{jumps:?}"
        );
        assert!(near(&jumps[0]["by"], by), "{jumps:?}");
        assert!(
            near(&jumps[0]["at"], stamp(24.99).as_seconds()),
            "{jumps:?}"
        );
        assert!(
            jumps[1]["messages"] == 1 && jumps[1]["diagnosed"] == true,
            "{jumps:?}"
        );
    }
}

#[test]
fn a_reference_whose_clock_jumps_is_diagnosed_in_parts() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (mut poses, readings) = sound(here);
    for message in &mut poses[8000..] {
        let nanos = message.header.stamp.nanos() + 3_600_000_000_000;
        message.header = cromosim_msgs::std_msgs::Header::new(nanos, "world");
    }
    poses[100].header.stamp = Default::default();
    write_as_it_came(&here.join("set.mcap"), &poses, &readings);
    let said = succeed_in_little_memory(here, &["diagnose", "set.mcap", "--out", "found"]);
    simulates_each_stamp(here, "set.mcap", "found");
    assert!(
        said.contains("the reference's stamps jump by 3600") && said.contains("part 2"),
        "{said}"
    );
    let found = diagnosis(here, "found");
    assert_eq!(causes(&found, "wrist"), set(&["lever_arm"]), "{said}");
    let jumps = found["placements"]["wrist"]["clock_jumps"]
        .as_array()
        .unwrap();
    assert!(
        jumps.len() == 2 && jumps.iter().all(|jump| jump["clock"] == "reference"),
        "{jumps:?}"
    );
    let diagnosed: Vec<bool> = jumps.iter().map(|jump| jump["diagnosed"] == true).collect();
    assert_eq!(diagnosed, [false, true], "{jumps:?}");
}

#[test]
fn a_reference_that_is_set_back_into_its_own_time_is_left_out_there() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (mut poses, readings) = sound(here);
    for message in &mut poses[8000..] {
        let nanos = message.header.stamp.nanos() - 30_000_000_000;
        message.header = cromosim_msgs::std_msgs::Header::new(nanos, "world");
    }
    write_as_it_came(&here.join("set.mcap"), &poses, &readings);
    let said = succeed(here, &["diagnose", "set.mcap", "--out", "found"]);
    assert!(
        said.contains("the reference's stamps jump by -30.0")
            && said.contains("4001 poses left out"),
        "{said}"
    );
    let found = diagnosis(here, "found");
    assert_eq!(causes(&found, "wrist"), set(&["lever_arm"]), "{said}");
}
