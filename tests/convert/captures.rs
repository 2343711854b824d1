//! Exports of motion capture systems: several bodies become several placements.

use std::fs;

use cromosim_bag::BagReader;
use cromosim_motion::{MarkerClip, MotionOptions, parse_trc, read_motion};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_recording::rigid::parse_tum;

use crate::common::{self, refuses, succeed};

/// A file that the tests of the library read, too.
fn sample(name: &str) -> String {
    let folder = common::root().join("nodes/lib/recording/tests/data/captures");
    folder.join(name).display().to_string()
}

#[test]
fn bodies_of_an_export_become_placements() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let at = |name: &str| here.join(name);
    let optitrack = sample("optitrack.csv");
    let said = succeed(here, &["inspect", &optitrack]);
    for line in [
        "recording of OptiTrack (CSV), 2 references at 120.000 Hz",
        "wand: 60 poses, 0.492 s, path of 0.50 m",
        "Rigid_Body_2: not seen in 4 of 60 frames",
    ] {
        assert!(said.contains(line), "{said}");
    }
    succeed(here, &["convert", &optitrack, "all.mcap"]);
    let bag = BagReader::open(&at("all.mcap")).unwrap();
    let count = |name: &str| bag.read::<PoseStamped>(name).unwrap().len();
    assert_eq!(
        [count("/reference/wand"), count("/reference/Rigid_Body_2")],
        [60, 56]
    );
    succeed(
        here,
        &["convert", &optitrack, "wand.tum", "--placement", "wand"],
    );
    let wand = parse_tum(&fs::read(at("wand.tum")).unwrap(), "wand.tum").unwrap();
    assert!((wand.positions[0].z - 1.0).abs() < 1e-9, "z is up");
    // As the file has it.
    succeed(
        here,
        &[
            "convert",
            &optitrack,
            "y.tum",
            "--placement",
            "wand",
            "--up-axis",
            "z",
        ],
    );
    let as_it_is = parse_tum(&fs::read(at("y.tum")).unwrap(), "y.tum").unwrap();
    assert!((as_it_is.positions[0].y - 1.0).abs() < 1e-9);

    let rigid = [
        "simulate", "--rigid", &optitrack, "--rate", "100", "--trim", "0",
    ];
    succeed(here, &[&rigid[..], &["--out", "both.mcap"]].concat());
    let bag = BagReader::open(&at("both.mcap")).unwrap();
    for name in ["wand", "Rigid_Body_2"] {
        let imu = bag.read::<Imu>(&format!("/imu/{name}/data_raw")).unwrap();
        let mean = imu.iter().map(|(_, imu)| imu.linear_acceleration.z);
        let mean = mean.sum::<f64>() / imu.len() as f64;
        assert!((mean - 9.8).abs() < 1.0, "{name}: {mean}");
    }
    succeed(
        here,
        &[
            &rigid[..],
            &["--placement", "grip=Rigid_Body_2", "--out", "one.mcap"],
        ]
        .concat(),
    );
    let bag = BagReader::open(&at("one.mcap")).unwrap();
    assert_eq!(
        bag.read::<PoseStamped>("/reference/grip").unwrap().len(),
        56
    );
}

#[test]
fn what_an_export_does_not_hold_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let optitrack = sample("optitrack.csv");
    let rigid = [
        "simulate", "--rigid", &optitrack, "--rate", "100", "--out", "o.mcap",
    ];
    refuses(
        here,
        &[&rigid[..], &["--placement", "wnd"]].concat(),
        &[
            "wnd",
            "no such body",
            "wand, Rigid_Body_2",
            "the nearest is wand",
        ],
    );
    refuses(
        here,
        &[
            &rigid[..],
            &["--placement", "a=wand", "--placement", "a=Rigid_Body_2"],
        ]
        .concat(),
        &["a is given twice"],
    );
    for (out, expected) in [
        (
            "o.tum",
            "several placements; give --placement, one of wand, Rigid_Body_2",
        ),
        (
            "o.parquet",
            "it has no IMU, and columns hold readings alone",
        ),
    ] {
        refuses(
            here,
            &["convert", &optitrack, out],
            &["optitrack.csv", expected],
        );
    }
    refuses(
        here,
        &["convert", &optitrack, "o.mcap", "--skeleton-map", "cmu"],
        &["--skeleton-map is for motions, and this is a recording; leave it out"],
    );
    fs::write(here.join("a.tum"), "0 0 0 1 0 0 0 1\n1 0 0 1 0 0 0 1\n").unwrap();
    refuses(
        here,
        &[
            "simulate",
            "--rigid",
            "a.tum",
            "--rate",
            "10",
            "--up-axis",
            "y",
            "--out",
            "o.mcap",
        ],
        &[
            "a.tum",
            "--up-axis is for motion files and exports of motion capture",
        ],
    );
}

#[test]
fn a_suit_is_a_motion_and_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let at = |name: &str| here.join(name);
    let suit = common::root().join("nodes/lib/motion/tests/data/suit.mvnx");
    let suit = suit.display().to_string();
    let said = succeed(here, &["inspect", &suit]);
    for line in [
        "recording of Xsens MVN (MVNX), 24 references",
        "a motion of a whole body, too",
        "no readings: sensorFreeAcceleration",
    ] {
        assert!(said.contains(line), "{said}");
    }
    let said = succeed(here, &["simulate", &suit, "--out", "suit.mcap"]);
    assert!(said.contains("5 placements, 0.99 s of"), "{said}");
    succeed(here, &["convert", &suit, "suit.npz"]);
    let motion = read_motion(&at("suit.npz"), &MotionOptions::default()).unwrap();
    assert!(motion.frames.len() > 30);
    succeed(
        here,
        &["convert", &suit, "hand.tum", "--joint", "left_wrist"],
    );
    succeed(
        here,
        &["convert", &suit, "hand2.tum", "--placement", "LeftHand"],
    );
    let [joint, segment] = ["hand.tum", "hand2.tum"]
        .map(|name| parse_tum(&fs::read(at(name)).unwrap(), name).unwrap());
    assert_eq!(joint.stamps.len(), segment.stamps.len());
    succeed(here, &["convert", &suit, "segments.mcap"]);
    let bag = BagReader::open(&at("segments.mcap")).unwrap();
    let poses = bag.read::<PoseStamped>("/reference/LeftHand").unwrap();
    assert_eq!(poses.len(), joint.stamps.len());
    assert!(poses[0].1.header.stamp.nanos() > 1_600_000_000_000_000_000);

    // With sensors: what they read.
    succeed(here, &["convert", &sample("suit.mvnx"), "sensors.mcap"]);
    let bag = BagReader::open(&at("sensors.mcap")).unwrap();
    let imu = bag.read::<Imu>("/imu/Pelvis/data").unwrap();
    assert!(imu.len() == 60 && imu[0].1.orientation_covariance[0] >= 0.0);
}

#[test]
fn what_sensors_exported_becomes_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let at = |name: &str| here.join(name);
    let dot = sample("dot.csv");
    let said = succeed(here, &["inspect", &dot]);
    for line in [
        "recording of Movella DOT or MT Manager (table), 1 IMU at 60.000 Hz",
        "Left_wrist: 59 readings",
        "1 rows left out",
        "Gyr taken as degrees a second",
    ] {
        assert!(said.contains(line), "{said}");
    }
    succeed(here, &["convert", &dot, "dot.mcap", "--name", "watch"]);
    let bag = BagReader::open(&at("dot.mcap")).unwrap();
    assert_eq!(bag.read::<Imu>("/imu/watch/data").unwrap().len(), 59);
    // Beside a trajectory, for a diagnosis.
    let wand = [
        &sample("vicon_nexus.csv"),
        "wand.tum",
        "--placement",
        "wand",
    ];
    succeed(here, &[&["convert"], &wand[..]].concat());
    let with = ["--name", "watch", "--imu", &dot];
    succeed(
        here,
        &[&["convert", "wand.tum", "session.mcap"], &with[..]].concat(),
    );
    let bag = BagReader::open(&at("session.mcap")).unwrap();
    let counts = [
        bag.read::<PoseStamped>("/reference/watch").unwrap().len(),
        bag.read::<Imu>("/imu/watch/data_raw").unwrap().len(),
    ];
    assert_eq!(counts, [60, 59]);
    refuses(
        here,
        &[
            "convert",
            "wand.tum",
            "o.mcap",
            "--imu",
            &sample("optitrack.csv"),
        ],
        &[
            "optitrack.csv",
            "a recording of 0 IMUs, and --imu takes one",
        ],
    );
}

/// The markers of a clip as Motive exports them: y up, millimetres.
fn motive(clip: &MarkerClip) -> String {
    let thrice = |words: &mut dyn Iterator<Item = &str>| -> String {
        words.map(|word| format!(",{word}").repeat(3)).collect()
    };
    let count = clip.labels.len();
    let mut text = format!(
        "Format Version,1.23,Export Frame Rate,{},Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\n\n,Type{}\n,Name{}\n,ID{}\n,{}\nFrame,Time (Seconds){}\n",
        clip.rate_hz,
        thrice(&mut std::iter::repeat_n("Marker", count)),
        thrice(&mut clip.labels.iter().map(String::as_str)),
        thrice(&mut clip.labels.iter().map(String::as_str)),
        thrice(&mut std::iter::repeat_n("Position", count)),
        ",X,Y,Z".repeat(count)
    );
    for (index, frame) in clip.frames.iter().enumerate() {
        text += &format!("{index},{:.6}", index as f64 / clip.rate_hz);
        for point in frame {
            let cells = point.map(|point| {
                let [x, y, z] = point.coords.map(|part| 1000.0 * part).into();
                format!(",{x:.6},{:.6},{:.6}", z, -y)
            });
            text += &cells.unwrap_or_else(|| ",,,".to_owned());
        }
        text.push('\n');
    }
    text
}

#[test]
fn markers_of_an_export_are_a_motion() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let suit = common::root().join("nodes/lib/motion/tests/data/suit.mvnx");
    succeed(here, &["convert", &suit.display().to_string(), "walk.trc"]);
    let trc = fs::read_to_string(here.join("walk.trc")).unwrap();
    let clip = parse_trc(&trc, "walk.trc").unwrap();
    fs::write(here.join("walk.csv"), motive(&clip)).unwrap();
    let [of_trc, of_table] = ["walk.trc", "walk.csv"].map(|name| {
        let said = succeed(here, &["inspect", name, "--placements-as-given"]);
        let lines = said.lines().skip(1).map(str::to_owned);
        lines.collect::<Vec<String>>()
    });
    assert!(of_trc.len() > 1, "{of_trc:?}");
    // Another axis is up; all else is the same.
    let mentions_up = |line: &&String| !line.contains("up ");
    let [of_trc, of_table] = [&of_trc, &of_table].map(|lines| {
        let lines = lines.iter().filter(mentions_up);
        lines.cloned().collect::<Vec<String>>()
    });
    assert_eq!(of_trc, of_table);
}
