//! Topics as robots have them: odometry, transforms, TF, motion capture, under any name.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::{cromosim_in, python, refuses, root, succeed, text};
use cromosim_bag::{BagOptions, BagReader, BagWriter};
use cromosim_msgs::geometry_msgs::{
    Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, Transform, TransformStamped,
    Vector3,
};
use cromosim_msgs::nav_msgs::Odometry;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::Stamp;

const REFERENCE: &str = "/reference/right_wrist";
const IMU: &str = "/imu/right_wrist/data_raw";

fn transform(pose: &Pose) -> Transform {
    let position = pose.position;
    Transform {
        translation: Vector3 {
            x: position.x,
            y: position.y,
            z: position.z,
        },
        rotation: pose.orientation,
    }
}

/// The wrist of bags/gap/session as a robot would record it: one pose stream in every form.
fn write_robot(path: &Path) {
    let session = BagReader::open(&root().join("bags/gap/session")).unwrap();
    let mut bag = BagWriter::create(path, BagOptions::default()).unwrap();
    let still = |parent: &str, child: &str, x: f64| TransformStamped {
        header: Header::new(0, parent),
        child_frame_id: child.to_owned(),
        transform: Transform {
            translation: Vector3 { x, y: 0.0, z: 0.0 },
            ..Transform::default()
        },
    };
    let (start, _) = session.summary().time_range.unwrap();
    let transforms = vec![still("map", "odom", 0.0), still("tool0", "camera", 0.25)];
    bag.write("/tf_static", start, &TFMessage { transforms })
        .unwrap();
    for (at, PoseStamped { header, pose }) in session.read::<PoseStamped>(REFERENCE).unwrap() {
        write_pose(&mut bag, at, &header, pose);
    }
    for (at, imu) in session.read::<Imu>(IMU).unwrap() {
        bag.write("/imu/data", at, &imu).unwrap();
    }
    bag.finish().unwrap();
}

fn write_pose(bag: &mut BagWriter, at: Stamp, header: &Header, pose: Pose) {
    let header = header.clone();
    let with_covariance = PoseWithCovariance {
        pose,
        covariance: [[0.01; 6]; 6],
    };
    let stamped = PoseStamped {
        header: header.clone(),
        pose,
    };
    bag.write("/vrpn_client_node/wrist/pose", at, &stamped)
        .unwrap();
    let estimated = PoseWithCovarianceStamped {
        header: header.clone(),
        pose: with_covariance,
    };
    bag.write("/amcl_pose", at, &estimated).unwrap();
    let odometry = Odometry {
        header: header.clone(),
        child_frame_id: "base_link".to_owned(),
        pose: with_covariance,
        ..Odometry::default()
    };
    bag.write("/odom", at, &odometry).unwrap();
    let moved = |parent: &str, child: &str| TransformStamped {
        header: Header {
            frame_id: parent.to_owned(),
            ..header.clone()
        },
        child_frame_id: child.to_owned(),
        transform: transform(&pose),
    };
    bag.write("/vicon/wrist/wrist", at, &moved("world", "wrist"))
        .unwrap();
    let transforms = vec![moved("odom", "tool0")];
    bag.write("/tf", at, &TFMessage { transforms }).unwrap();
}

fn diagnosed(folder: &Path, recording: &str, options: &[&str]) -> String {
    let out = folder.join("diagnosis");
    let base = [
        "diagnose",
        recording,
        "--force",
        "--out",
        out.to_str().unwrap(),
    ];
    succeed(folder, &[&base, options].concat());
    fs::read_to_string(out.join("diagnosis.json")).unwrap()
}

/// The diagnosis of the session's wrist alone.
fn expected(folder: &Path) -> String {
    let only = folder.join("only.yaml");
    fs::write(&only, "placements: [right_wrist]\n").unwrap();
    let session = root().join("bags/gap/session");
    diagnosed(
        folder,
        session.to_str().unwrap(),
        &["--config", only.to_str().unwrap()],
    )
}

#[test]
fn a_reference_gives_the_same_diagnosis_in_every_form() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_robot(&folder.join("robot.mcap"));
    let expected = expected(folder);
    assert!(expected.contains("time_offset") && expected.contains("lever_arm"));
    for reference in [
        "/vrpn_client_node/wrist/pose",
        "/amcl_pose",
        "/odom",
        "/odom:base_link",
        "/vicon/wrist/wrist",
        "/tf:tool0@odom",
        "/tf:tool0",
    ] {
        let named = format!("right_wrist={reference}");
        let options = ["--reference-topic", &named, "--imu-topic", "/imu/data"];
        let found = diagnosed(folder, "robot.mcap", &options);
        assert!(found == expected, "{reference}: another diagnosis");
    }
    // A frame behind a static one is another place: 25 cm off, which is no lever arm of 6 cm.
    let options = [
        "--reference-topic",
        "right_wrist=/tf:camera@map",
        "--imu-topic",
        "/imu/data",
    ];
    assert!(diagnosed(folder, "robot.mcap", &options) != expected);
}

#[test]
fn the_other_commands_take_the_same_topics() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_robot(&folder.join("robot.mcap"));
    let said = succeed(folder, &["inspect", "robot.mcap"]);
    for line in [
        "reference: /odom:BODY of base_link",
        "reference: /tf:BODY of tool0",
    ] {
        assert!(said.contains(line), "{said}");
    }
    let topics = [
        "--reference-topic",
        "/odom",
        "--imu-topic",
        "wrist=/imu/data",
    ];
    let simulate = [
        "simulate",
        "--reference",
        "robot.mcap",
        "--out",
        "again.mcap",
    ];
    succeed(folder, &[&simulate[..], &topics].concat());
    let compare = [
        "compare",
        "robot.mcap",
        "again.mcap",
        "--imu-topic",
        "wrist=/imu/data",
    ];
    let said = succeed(folder, &compare);
    assert!(said.contains("wrist"), "{said}");
    for (topic, out) in [("/odom", "odom.tum"), ("/tf:tool0@odom", "tf.tum")] {
        succeed(folder, &["convert", "robot.mcap", out, "--topic", topic]);
    }
    let read = |name: &str| {
        let text = fs::read_to_string(folder.join(name)).unwrap();
        let rows = text.lines().filter(|line| !line.starts_with('#'));
        rows.map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(read("odom.tum").len() > 100);
    assert_eq!(read("odom.tum"), read("tf.tum"));
}

#[test]
fn slips_are_one_line_with_what_the_bag_has() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_robot(&folder.join("robot.mcap"));
    let refused = |options: &[&str], words: &[&str]| {
        let base = ["diagnose", "robot.mcap", "--out", "never"];
        refuses(folder, &[&base, options].concat(), words);
    };
    refused(
        &["--reference-topic", "/odm"],
        &["/odm", "/imu/data", "nearest is /odom"],
    );
    refused(
        &["--reference-topic", "/imu/data"],
        &["sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry", "/odom"],
    );
    refused(
        &["--reference-topic", "/odom", "--imu-topic", "/tf"],
        &["tf2_msgs/msg/TFMessage", "sensor_msgs/msg/Imu", "/imu/data"],
    );
    let imu = ["--imu-topic", "/imu/data", "--reference-topic"];
    refused(
        &[&imu[..], &["a=/tf:tool@odom"]].concat(),
        &["no frame tool", "tool0"],
    );
    refused(
        &[&imu[..], &["a=/odom:base_lnk"]].concat(),
        &["base_lnk", "base_link"],
    );
    refused(&[&imu[..], &["a=/tf"]].concat(), &["/tf:FRAME", "tool0"]);
    refused(
        &["--reference-topic", "a=/odom", "--imu-topic", "b=/imu/data"],
        &["placement b", "no reference"],
    );
}

/// Writes the same with rosbags: another program's Odometry, and motion capture of two bodies.
const MAKE: &str = r#"
import sys
from pathlib import Path
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
import numpy as np
source, target = map(Path, sys.argv[1:])
store = get_typestore(Stores.ROS2_JAZZY)
for name, text in [
    ("Marker", "int8 USE_NAME=0\nint8 id_type\nint32 marker_index\nstring marker_name\ngeometry_msgs/Point translation\n"),
    ("RigidBody", "string rigid_body_name\nmocap4r2_msgs/Marker[] markers\ngeometry_msgs/Pose pose\n"),
    ("RigidBodies", "std_msgs/Header header\nuint32 frame_number\nmocap4r2_msgs/RigidBody[] rigidbodies\n"),
]:
    store.register(get_types_from_msg(text, f"mocap4r2_msgs/msg/{name}"))
t = store.types
with AnyReader([source], default_typestore=store) as reader, Writer(target, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
    add = lambda topic, kind: writer.add_connection(topic, kind, typestore=store)
    odom, imu, mocap = add("/odom", "nav_msgs/msg/Odometry"), add("/imu/data", "sensor_msgs/msg/Imu"), add("/rigid_bodies", "mocap4r2_msgs/msg/RigidBodies")
    V, P, Q = (t[f"geometry_msgs/msg/{name}"] for name in ("Vector3", "Pose", "Quaternion"))
    zero = V(0.0, 0.0, 0.0)
    twist = t["geometry_msgs/msg/TwistWithCovariance"](t["geometry_msgs/msg/Twist"](zero, zero), np.zeros(36))
    point = t["geometry_msgs/msg/Point"]
    marker = t["mocap4r2_msgs/msg/Marker"](id_type=1, marker_index=3, marker_name="m", translation=point(1.0, 2.0, 3.0))
    body = t["mocap4r2_msgs/msg/RigidBody"]
    frame = 0
    for connection, at, raw in reader.messages():
        message = reader.deserialize(raw, connection.msgtype)
        if connection.topic == "/imu/right_wrist/data_raw":
            writer.write(imu, at, store.serialize_cdr(message, imu.msgtype))
        if connection.topic == "/reference/right_wrist":
            pose = t["geometry_msgs/msg/PoseWithCovariance"](message.pose, np.full(36, 0.01))
            said = t["nav_msgs/msg/Odometry"](message.header, "base_link", pose, twist)
            writer.write(odom, at, store.serialize_cdr(said, odom.msgtype))
            frame += 1
            other = P(point(0.5, 0.5, 0.5), Q(0.0, 0.0, 0.0, 1.0))
            bodies = [body("helmet", [], other), body("watch", [marker] * (frame % 3), message.pose)]
            said = t["mocap4r2_msgs/msg/RigidBodies"](message.header, frame, bodies)
            writer.write(mocap, at, store.serialize_cdr(said, mocap.msgtype))
"#;

#[test]
fn odometry_and_motion_capture_that_rosbags_wrote() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = Command::new(python)
        .args(["-c", MAKE])
        .arg(root().join("bags/gap/session"))
        .arg(folder.join("robot"))
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", text(&made));
    let expected = expected(folder);
    for reference in ["/odom", "/rigid_bodies:watch"] {
        let named = format!("right_wrist={reference}");
        let options = ["--reference-topic", &named, "--imu-topic", "/imu/data"];
        let found = diagnosed(folder, "robot", &options);
        assert!(found == expected, "{reference}: another diagnosis");
    }
    let several = cromosim_in(
        folder,
        &[
            "diagnose",
            "robot",
            "--out",
            "never",
            "--reference-topic",
            "a=/rigid_bodies",
            "--imu-topic",
            "/imu/data",
        ],
    );
    assert_eq!(several.status.code(), Some(2));
    assert!(
        text(&several).contains("helmet, watch"),
        "{}",
        text(&several)
    );
}
