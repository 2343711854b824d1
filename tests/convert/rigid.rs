//! Robots and props: rigid trajectories, their IMUs, frames of TF.

use std::fs;

use cromosim_bag::{BagOptions, BagReader, BagWriter};
use cromosim_msgs::geometry_msgs::{PoseStamped, Transform, TransformStamped};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_recording::rigid::{parse_euroc_imu, parse_tum, write_tum};
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, Vector3};

use crate::common::{refuses, succeed};
use crate::files::swing;

#[test]
fn a_rigid_body_carries_an_imu_and_its_files_become_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let swing = swing(20.0);
    fs::write(at("robot.tum"), write_tum(&swing)).unwrap();
    let said = succeed(
        folder.path(),
        &[
            "simulate",
            "--rigid",
            "robot.tum",
            "--placement",
            "gripper",
            "--rate",
            "100",
            "--device",
            "consumer_mems",
            "--trim",
            "0",
            "--out",
            "robot.mcap",
        ],
    );
    assert!(said.contains("gripper"), "{said}");
    succeed(
        folder.path(),
        &[
            "simulate",
            "--rigid",
            "robot.tum",
            "--placement",
            "gripper",
            "--rate",
            "100",
            "--trim",
            "0",
            "--out",
            "ideal.mcap",
        ],
    );
    let [real, ideal] = ["robot.mcap", "ideal.mcap"].map(|name| {
        BagReader::open(&at(name))
            .unwrap()
            .read::<Imu>("/imu/gripper/data_raw")
            .unwrap()
    });
    assert_eq!((real.len(), ideal.len()), (2000, 2000));
    // What the trajectory's second derivative says, in its middle.
    for (_, imu) in &ideal[200..1800] {
        let index = swing
            .stamps
            .iter()
            .position(|stamp| stamp.nanos >= imu.header.stamp.nanos())
            .unwrap();
        let time = (imu.header.stamp.nanos() - swing.stamps[0].nanos) as f64 * 1e-9;
        let acceleration = Vector3::new(
            -0.3 * 2.1 * 2.1 * (2.1 * time).sin(),
            -0.2 * 3.3 * 3.3 * (3.3 * time).cos(),
            -0.1 * 1.3 * 1.3 * (1.3 * time).sin(),
        );
        let expected =
            swing.rotations[index].inverse() * (acceleration + Vector3::new(0.0, 0.0, 9.80665));
        let found: Vector3<f64> = imu.linear_acceleration.into();
        assert!(
            (found - expected).norm() < 0.02,
            "{time}: {found} {expected}"
        );
    }
    assert!(
        real.iter()
            .zip(&ideal)
            .any(|((_, a), (_, b))| a.linear_acceleration != b.linear_acceleration),
        "the device adds noise"
    );

    // Out of the bag as EuRoC has it, and into a bag again.
    succeed(
        folder.path(),
        &[
            "convert",
            "robot.mcap",
            "imu.csv",
            "--to",
            "euroc",
            "--topic",
            "/imu/gripper/data_raw",
        ],
    );
    assert_eq!(
        parse_euroc_imu(&fs::read(at("imu.csv")).unwrap(), "imu.csv")
            .unwrap()
            .stamps
            .len(),
        2000
    );
    succeed(folder.path(), &["convert", "imu.csv", "table.csv"]);
    succeed(
        folder.path(),
        &["convert", "table.csv", "back.csv", "--to", "euroc"],
    );
    assert!(fs::read(at("imu.csv")).unwrap() == fs::read(at("back.csv")).unwrap());
    let said = succeed(folder.path(), &["inspect", "imu.csv", "table.csv"]);
    assert!(
        said.contains("IMU series (EuRoC), 2000 rows at 100.000 Hz")
            && said.contains("IMU series (table"),
        "{said}"
    );
    succeed(
        folder.path(),
        &[
            "convert",
            "robot.tum",
            "made.mcap",
            "--name",
            "gripper",
            "--imu",
            "imu.csv",
        ],
    );
    let made = BagReader::open(&at("made.mcap")).unwrap();
    assert_eq!(
        made.read::<PoseStamped>("/reference/gripper")
            .unwrap()
            .len(),
        swing.stamps.len()
    );
    let messages = made.read::<Imu>("/imu/gripper/data_raw").unwrap();
    assert_eq!(messages.len(), 2000);
    assert_eq!(
        messages[7].1.linear_acceleration,
        real[7].1.linear_acceleration
    );
    succeed(
        folder.path(),
        &["diagnose", "made.mcap", "--out", "diagnosis"],
    );
    let diagnosis = fs::read_to_string(at("diagnosis/diagnosis.json")).unwrap();
    assert!(diagnosis.contains("\"gripper\""), "{diagnosis}");
}

#[test]
fn frames_of_tf_become_a_trajectory() {
    let folder = tempfile::tempdir().unwrap();
    let mut bag = BagWriter::create(&folder.path().join("tf.mcap"), BagOptions::default()).unwrap();
    let transform =
        |nanos: i64, parent: &str, child: &str, pose: Isometry3<f64>| TransformStamped {
            header: Header::new(nanos, parent),
            child_frame_id: child.to_owned(),
            transform: Transform::from(pose),
        };
    let turned = Isometry3::new(
        Vector3::new(0.0, 0.0, 0.5),
        Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2),
    );
    let fixed = TFMessage {
        transforms: vec![transform(0, "arm", "tool", turned)],
    };
    bag.write("/tf_static", Stamp::from_nanos(1_000_000_000), &fixed)
        .unwrap();
    for index in 0..11_i64 {
        let (nanos, x) = (1_000_000_000 + index * 100_000_000, 0.1 * index as f64);
        // The cart comes half as often as the arm, which hangs on it.
        let mut transforms = vec![transform(
            nanos,
            "cart",
            "arm",
            Isometry3::translation(0.0, x, 0.0),
        )];
        if index % 2 == 0 {
            transforms.push(transform(
                nanos,
                "world",
                "cart",
                Isometry3::translation(x, 0.0, 0.0),
            ));
        }
        bag.write("/tf", Stamp::from_nanos(nanos), &TFMessage { transforms })
            .unwrap();
    }
    bag.finish().unwrap();
    refuses(
        folder.path(),
        &["convert", "tf.mcap", "tool.tum", "--frame", "tol"],
        &["tf.mcap", "no frame tol", "; the nearest is tool"],
    );
    succeed(
        folder.path(),
        &["convert", "tf.mcap", "tool.tum", "--frame", "tool"],
    );
    let tool = parse_tum(
        &fs::read(folder.path().join("tool.tum")).unwrap(),
        "tool.tum",
    )
    .unwrap();
    assert_eq!(tool.stamps.len(), 11);
    for (index, (position, rotation)) in tool.positions.iter().zip(&tool.rotations).enumerate() {
        let x = 0.1 * index as f64;
        assert!(
            (position - Vector3::new(x, x, 0.5)).norm() < 1e-12,
            "{index}: {position}"
        );
        assert!(rotation.angle_to(&turned.rotation) < 1e-12);
    }
    succeed(
        folder.path(),
        &[
            "convert",
            "tf.mcap",
            "arm.tum",
            "--frame",
            "tool",
            "--fixed-frame",
            "cart",
        ],
    );
    let arm = parse_tum(&fs::read(folder.path().join("arm.tum")).unwrap(), "arm.tum").unwrap();
    assert!((arm.positions[3] - Vector3::new(0.0, 0.3, 0.5)).norm() < 1e-12);
    refuses(
        folder.path(),
        &["convert", "tf.mcap", "x.tum", "--frame", "hand"],
        &["no frame hand", "arm, cart, tool"],
    );
    refuses(
        folder.path(),
        &[
            "convert",
            "tf.mcap",
            "x.tum",
            "--frame",
            "cart",
            "--fixed-frame",
            "tool",
        ],
        &["does not hang on tool"],
    );
    refuses(
        folder.path(),
        &["convert", "tf.mcap", "x.tum"],
        &["no topic of geometry_msgs/msg/PoseStamped", "--frame"],
    );
}
