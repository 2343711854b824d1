//! The plain ways of the command line: what is said of a bag, recordings in namespaces, placements
//! without a file, lists.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{refuses, succeed};
use cromosim_bag::{BagOptions, BagReader, BagWriter, Selection};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

fn imu_at(stamp: Stamp) -> Imu {
    Imu {
        header: Header::new(stamp.nanos, "wrist_imu"),
        ..Imu::default()
    }
}

#[test]
fn rates_are_of_the_topics_own_span() {
    let folder = tempfile::tempdir().unwrap();
    let mut bag = BagWriter::create(&folder.path().join("a.mcap"), BagOptions::default()).unwrap();
    let at = |seconds: f64| Stamp::from_nanos(1_000_000_000).plus_seconds(seconds);
    // Recorded late and unevenly; measured at 50 Hz for a third of the bag, with a gap of 2.02 s.
    for k in 0..500 {
        let measured = 0.02 * f64::from(k) + if k < 200 { 0.0 } else { 2.0 };
        let late = 0.004 * f64::from(k % 3);
        let message = imu_at(at(measured));
        bag.write("/imu/wrist/data_raw", at(measured + late), &message)
            .unwrap();
    }
    for k in 0..3600 {
        let stamp = at(0.01 * f64::from(k));
        bag.write("/imu/ankle/data_raw", stamp, &imu_at(stamp))
            .unwrap();
    }
    bag.finish().unwrap();
    let said = succeed(folder.path(), &["inspect", "a.mcap"]);
    let line = |name: &str| said.lines().find(|line| line.contains(name)).unwrap();
    let wrist = line("/imu/wrist/data_raw");
    for part in [" 50.00 Hz", "spans 11.980 s", "1 gap of up to 2.020 s"] {
        assert!(wrist.contains(part), "{part}: {said}");
    }
    assert!(!wrist.contains("jitter"), "of the header's stamps: {said}");
    let ankle = line("/imu/ankle/data_raw");
    assert!(
        ankle.contains("100.00 Hz") && !ankle.contains(','),
        "{said}"
    );
}

/// A bag whose topics are those of another, once in each of some namespaces.
fn copy_into(from: &Path, to: &Path, namespaces: &[&str]) {
    let reader = BagReader::open(from).unwrap();
    let mut bag = BagWriter::create(to, BagOptions::default()).unwrap();
    for message in reader.messages(&Selection::default()).unwrap() {
        let message = message.unwrap();
        for namespace in namespaces {
            let topic = cromosim_bag::Topic {
                name: format!("{namespace}{}", message.topic.name),
                ..(*message.topic).clone()
            };
            let topic = bag.add_topic(&topic).unwrap();
            bag.write_payload(
                topic,
                &message.payload,
                message.log_time,
                message.publish_time,
            )
            .unwrap();
        }
    }
    bag.finish().unwrap();
}

#[test]
fn recordings_in_namespaces_are_diagnosed_simulated_and_compared() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let simulate = [
        "simulate",
        "--walk",
        "--placement",
        "wrist=left_watch",
        "--out",
    ];
    succeed(here, &[&simulate[..], &["plain.mcap"]].concat());
    let plain = here.join("plain.mcap");
    copy_into(&plain, &here.join("one.mcap"), &["/robot1"]);
    copy_into(&plain, &here.join("two.mcap"), &["/robot1", "/robot2"]);
    succeed(here, &["diagnose", "plain.mcap", "--out", "plain"]);
    succeed(here, &["diagnose", "one.mcap", "--out", "one"]);
    let two = ["diagnose", "two.mcap", "--out", "two"];
    refuses(here, &two, &["two.mcap", "/robot1, /robot2", "--namespace"]);
    let wrong = [&two[..], &["--namespace", "robot3"]].concat();
    refuses(here, &wrong, &["/robot3", "/robot1, /robot2"]);
    succeed(here, &[&two[..], &["--namespace", "robot2"]].concat());
    let diagnosis = |name: &str| fs::read(here.join(name).join("diagnosis.json")).unwrap();
    assert_eq!(diagnosis("one"), diagnosis("plain"));
    assert_eq!(diagnosis("two"), diagnosis("plain"));

    let again = ["simulate", "--reference", "two.mcap", "--out", "again.mcap"];
    refuses(here, &again, &["/robot1, /robot2"]);
    succeed(here, &[&again[..], &["--namespace", "/robot2"]].concat());
    let reader = BagReader::open(&here.join("again.mcap")).unwrap();
    let topics = reader.summary().topics.iter();
    let names: Vec<&str> = topics.map(|own| own.topic.name.as_str()).collect();
    assert_eq!(names, ["/robot2/imu/wrist/data_raw"]);
    let compare = ["compare", "two.mcap", "again.mcap", "--namespace", "robot2"];
    let said = succeed(here, &compare);
    assert!(said.contains("wrist"), "{said}");
}

#[test]
fn placements_are_given_without_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let pairs = [
        "--placement",
        "watch=left_watch",
        "--placement",
        "hip=chest_left",
    ];
    succeed(
        here,
        &[&["simulate", "--walk", "--out", "a.mcap"], &pairs[..]].concat(),
    );
    let reader = BagReader::open(&here.join("a.mcap")).unwrap();
    let rate = |name: &str| reader.cadences().unwrap()[name].rate_hz;
    for name in ["/imu/watch/data_raw", "/imu/hip/data_raw"] {
        assert!((rate(name) - 100.0).abs() < 1e-6, "{name}: {}", rate(name));
    }
    let with = |given: &'static str| {
        [
            "simulate",
            "--walk",
            "--out",
            "b.mcap",
            "--placement",
            given,
        ]
    };
    refuses(
        here,
        &with("watch"),
        &["--placement watch", "NAME=SITE", "body sites"],
    );
    refuses(here, &with("a=left_wach"), &["left_wach", "left_watch"]);
    refuses(here, &with("a/b=left_watch"), &["--placement", "`a/b`"]);
    let twice = [&with("a=left_watch")[..], &["--placement", "a=sternum"]].concat();
    refuses(here, &twice, &["--placement", "another placement"]);
    let both = [&with("a=left_watch")[..], &["--placements", "p.yaml"]].concat();
    refuses(here, &both, &["--placement and --placements"]);
    assert!(!here.join("b.mcap").exists());
}

#[test]
fn what_has_a_name_is_listed() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let lists: [(&[&str], &[&str], usize); 8] = [
        (&["body", "sites"], &["left_watch", "sternum"], 68),
        (&["list", "sites"], &["left_watch", "sternum"], 68),
        (
            &["diagnose", "--list-effects"],
            &["lever_arm: offset [m]"],
            70,
        ),
        (&["list", "effects"], &["gyro_bias: bias [rad/s]"], 70),
        (&["list", "schemes"], &["adaptive_spline", "richardson"], 6),
        (&["list", "devices"], &["ideal", "consumer_mems"], 3),
        (&["list", "models"], &["motion_capture_60", "video"], 5),
        (&["list", "nodes"], &["virtual_imu", "gap_monitor"], 6),
    ];
    for (arguments, words, least) in lists {
        let said = succeed(here, arguments);
        for word in words {
            assert!(said.contains(word), "{arguments:?}: {word} in {said}");
        }
        assert!(said.lines().count() >= least, "{arguments:?}: {said}");
    }
    // Nothing is left without --out and recordings.
    refuses_usage(here, &["diagnose", "--out", "d"], "RECORDING");
    refuses_usage(here, &["diagnose", "a.mcap"], "--out");
}

#[test]
fn names_are_completed_by_the_shell() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let script = succeed(folder.path(), &["completion", shell]);
        let names = ["left_watch", "gyro_g_sensitivity", "adaptive_spline"];
        for name in names
            .iter()
            .chain(&["consumer_mems", "virtual_imu", "shank"])
        {
            assert!(script.contains(name), "{shell}: {name}");
        }
    }
}

/// The command line itself is refused.
fn refuses_usage(folder: &Path, arguments: &[&str], word: &str) {
    let output = common::cromosim_in(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    assert!(common::text(&output).contains(word), "{arguments:?}");
}

#[test]
fn one_placement_becomes_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let wrist = [
        "simulate",
        "--walk",
        "--placement",
        "wrist=left_watch",
        "--out",
    ];
    succeed(here, &[&wrist[..], &["wrist.csv"]].concat());
    let text = fs::read_to_string(here.join("wrist.csv")).unwrap();
    let mut lines = text.lines();
    assert!(
        lines
            .next()
            .unwrap()
            .starts_with("time [s],specific_force_x [m/s2],")
    );
    // The same readings as in a bag, to the last digit, and readable as what they are.
    succeed(here, &[&wrist[..], &["wrist.mcap"]].concat());
    let reader = BagReader::open(&here.join("wrist.mcap")).unwrap();
    let messages = reader.read::<Imu>("/imu/wrist/data").unwrap();
    assert_eq!(lines.clone().count(), messages.len());
    for (line, (_, message)) in lines.zip(&messages) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let stamp = &message.header.stamp;
        assert!((cells[0] - f64::from(stamp.sec) - 1e-9 * f64::from(stamp.nanosec)).abs() < 1e-9);
        assert_eq!(cells[1], message.linear_acceleration.x);
        assert_eq!(cells[6], message.angular_velocity.z);
    }
    let said = succeed(here, &["inspect", "wrist.csv"]);
    assert!(
        said.contains("IMU series") && said.contains("100.000 Hz"),
        "{said}"
    );
    refuses(here, &[&wrist[..], &["wrist.csv"]].concat(), &["--force"]);
    refuses(
        here,
        &["simulate", "--walk", "--out", "all.csv"],
        &["all.csv", "--placement NAME=SITE", "--csv DIR"],
    );
    assert!(!here.join("all.csv").exists());
}
