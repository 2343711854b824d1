//! `cromosim convert` and what goes with it: files there and back through the command, refusals,
//! robots and props.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::path::Path;

use common::{refuses, succeed};
use cromosim_bag::{BagOptions, BagReader, BagWriter};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::rigid::{PoseTrajectory, parse_euroc_imu, parse_tum, write_tum};
use cromosim_motion::{MotionOptions, embedded_walk, read_motion, write_bvh};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_msgs::geometry_msgs::{PoseStamped, Transform, TransformStamped};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::Stamp;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// The embedded walk as walk.bvh.
fn walk(folder: &Path, seconds: f64) {
    let motion = embedded_walk().slice(2.0, Some(seconds)).unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap();
    fs::write(folder.join("walk.bvh"), write_bvh(&motion, &body)).unwrap();
}

/// A body that swings and turns, at 200 Hz.
fn swing(seconds: f64) -> PoseTrajectory {
    let mut trajectory = PoseTrajectory::default();
    for index in 0..(200.0 * seconds) as i64 {
        let time = index as f64 / 200.0;
        trajectory.stamps.push(Stamp::from_nanos(
            1_700_000_000_000_000_000 + index * 5_000_000,
        ));
        trajectory.positions.push(Vector3::new(
            0.3 * (2.1 * time).sin(),
            0.2 * (3.3 * time).cos(),
            1.0 + 0.1 * (1.3 * time).sin(),
        ));
        let axis = Vector3::new(
            (0.7 * time).sin(),
            (1.9 * time).cos(),
            0.5 * (1.1 * time).sin(),
        );
        trajectory
            .rotations
            .push(UnitQuaternion::from_scaled_axis(axis));
    }
    trajectory
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Rows without comments, in which formats differ.
fn rows(path: &Path) -> Vec<String> {
    fs::read_to_string(path)
        .unwrap()
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(str::to_owned)
        .collect()
}

#[test]
fn a_motion_becomes_bvh_npz_and_markers() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    walk(folder.path(), 1.0);
    let said = succeed(folder.path(), &["convert", "walk.bvh", "again.bvh"]);
    assert!(said.contains("a BVH file of 101 frames"), "{said}");
    let [first, again] = ["walk.bvh", "again.bvh"]
        .map(|name| read_motion(&at(name), &MotionOptions::default()).unwrap());
    for (a, b) in first.frames.iter().zip(&again.frames) {
        assert!((a.root_position - b.root_position).norm() < 1e-4);
        assert!(
            a.world_rotations()
                .iter()
                .zip(&b.world_rotations())
                .all(|(a, b)| a.angle_to(b) < 1e-4)
        );
    }
    succeed(folder.path(), &["convert", "walk.bvh", "walk.npz"]);
    let mut npz = cromosim_arrays::NpzReader::open(&at("walk.npz")).unwrap();
    assert_eq!(
        npz.keys(),
        [
            "betas",
            "body",
            "gender",
            "mocap_framerate",
            "poses",
            "surface_model_type",
            "trans"
        ]
    );
    assert_eq!(npz.header("poses").unwrap().unwrap().shape, [101, 72]);
    // Markers are placed on the walk, and the fit to them finds the walk again.
    succeed(folder.path(), &["convert", "walk.bvh", "markers.trc"]);
    let said = succeed(
        folder.path(),
        &["inspect", "markers.trc", "--placements-as-given"],
    );
    assert!(
        said.contains("marker set plug_in_gait") && said.contains("mm (root mean square)"),
        "{said}"
    );
    succeed(
        folder.path(),
        &[
            "convert",
            "markers.trc",
            "fitted.tum",
            "--joint",
            "left_wrist",
            "--placements-as-given",
        ],
    );
    succeed(
        folder.path(),
        &["convert", "walk.bvh", "known.tum", "--joint", "left_wrist"],
    );
    let [fitted, known] = ["fitted.tum", "known.tum"]
        .map(|name| parse_tum(&fs::read(at(name)).unwrap(), name).unwrap());
    assert_eq!(fitted.stamps, known.stamps);
    let mut errors: Vec<f64> = fitted
        .positions
        .iter()
        .zip(&known.positions)
        .map(|(a, b)| (a - b).norm())
        .collect();
    errors.sort_by(f64::total_cmp);
    println!(
        "left wrist by exact markers: median {:.2} mm, largest {:.2} mm",
        1e3 * errors[50],
        1e3 * errors[100]
    );
    assert!(errors[100] < 8e-3, "{errors:?}");
}

#[test]
fn trajectories_go_round_through_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    walk(folder.path(), 0.5);
    succeed(
        folder.path(),
        &["convert", "walk.bvh", "watch.tum", "--site", "left_watch"],
    );
    succeed(folder.path(), &["convert", "watch.tum", "watch.csv"]);
    succeed(
        folder.path(),
        &["convert", "watch.csv", "data.csv", "--to", "euroc"],
    );
    succeed(
        folder.path(),
        &["convert", "data.csv", "watch.mcap", "--name", "wrist"],
    );
    succeed(folder.path(), &["convert", "watch.mcap", "again.tum"]);
    succeed(folder.path(), &["convert", "data.csv", "exact.tum"]);
    assert!(rows(&at("watch.tum")) == rows(&at("exact.tum")));
    // Quaternions of messages are brought to length 1 once more.
    let [first, again] = ["watch.tum", "again.tum"]
        .map(|name| parse_tum(&fs::read(at(name)).unwrap(), name).unwrap());
    assert!(first.stamps == again.stamps && first.positions == again.positions);
    assert!(
        first
            .rotations
            .iter()
            .zip(&again.rotations)
            .all(|(a, b)| (a.coords - b.coords).norm() < 1e-15)
    );
    for (name, kind) in [
        ("watch.tum", "TUM"),
        ("watch.csv", "table"),
        ("data.csv", "EuRoC"),
    ] {
        let said = succeed(folder.path(), &["inspect", name]);
        assert!(
            said.contains("trajectory (") && said.contains(kind) && said.contains("51 rows"),
            "{said}"
        );
    }
    // EuRoC's velocities and biases survive what can hold them.
    let full = "#timestamp, p_RS_R_x [m]\n5,1,2,3,1,0,0,0,4,5,6,7,8,9,10,11,12\n7,1,2,3,1,0,0,0,4,5,6,7,8,9,10,11,12\n";
    fs::write(at("full.csv"), full).unwrap();
    succeed(
        folder.path(),
        &["convert", "full.csv", "same.csv", "--to", "euroc"],
    );
    assert_eq!(rows(&at("full.csv")), rows(&at("same.csv")));
}

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

/// A file that the tests of the library read, too.
fn sample(name: &str) -> String {
    let folder = if name.ends_with(".mat") {
        "nodes/lib/motion/tests/data"
    } else {
        "tests/fuzz/samples/datasets"
    };
    common::root().join(folder).join(name).display().to_string()
}

#[test]
fn recordings_of_data_sets_become_bags() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let at = |name: &str| here.join(name);
    // BROAD, as it is published: reference and IMU from a second on, and when it moved.
    succeed(
        here,
        &[
            "convert",
            &sample("broad.mat"),
            "broad.mcap",
            "--name",
            "tool",
        ],
    );
    let bag = BagReader::open(&at("broad.mcap")).unwrap();
    let (poses, imus) = (
        bag.read::<PoseStamped>("/reference/tool").unwrap(),
        bag.read::<Imu>("/imu/tool/data_raw").unwrap(),
    );
    assert_eq!(
        (poses.len(), imus.len(), imus[0].1.header.stamp.nanos()),
        (37, 40, 1_000_000_000)
    );
    assert_eq!(
        (
            imus[3].1.linear_acceleration.z,
            imus[3].1.angular_velocity.z
        ),
        (9.8, 0.5)
    );
    let activities = String::from_utf8(bag.attachment("activities.csv").unwrap().to_vec()).unwrap();
    assert_eq!(
        activities,
        "start_ns,end_ns,activity\n1000000000,1066500000,rest\n1070000000,1136500000,movement\n"
    );
    succeed(
        here,
        &[
            "convert",
            &sample("broad.mat"),
            "part.tum",
            "--start",
            "0.05",
            "--duration",
            "0.02",
        ],
    );
    let part = parse_tum(&fs::read(at("part.tum")).unwrap(), "part.tum").unwrap();
    assert_eq!((part.stamps.len(), part.stamps[0].nanos), (6, 52_500_000));
    let said = succeed(here, &["inspect", &sample("broad.mat")]);
    assert!(
        said.contains("recording of BROAD, 1 IMU at 285.714 Hz")
            && said.contains("reference of 37 poses"),
        "{said}"
    );

    // TotalCapture with its skeleton in the folder of the trial: a reference for each sensor that
    // has a joint.
    fs::copy(
        sample("totalcapture.sensors"),
        at("acting1_Xsens_AuxFields.sensors"),
    )
    .unwrap();
    fs::create_dir(at("acting1")).unwrap();
    fs::write(
        at("acting1/gt_skel_gbl_pos.txt"),
        "Hips\tHead\n0 40 0\t0 70 10\n10 40 0\t0 70 10\n",
    )
    .unwrap();
    fs::write(
        at("acting1/gt_skel_gbl_ori.txt"),
        "Hips\tHead\n0 0 0 1\t0 0.6 0 0.8\n0 0 0 1\t0 0 0 1\n",
    )
    .unwrap();
    succeed(
        here,
        &["convert", "acting1_Xsens_AuxFields.sensors", "acting.mcap"],
    );
    let bag = BagReader::open(&at("acting.mcap")).unwrap();
    let poses = bag.read::<PoseStamped>("/reference/Head").unwrap();
    assert!(
        poses.len() == 2 && (poses[0].1.pose.position.z - 1.778).abs() < 1e-12,
        "inches, y up: {:?}",
        poses[0]
    );
    let full = bag.read::<Imu>("/imu/L_LowArm/data").unwrap();
    assert!(
        (full.len(), full[0].1.orientation.w, full[0].1.orientation.y) == (3, 0.8, 0.6),
        "the device's own orientation"
    );
    assert_eq!(
        bag.read::<Imu>("/imu/L_LowArm/data_raw").unwrap()[2]
            .1
            .linear_acceleration
            .x,
        3.0
    );
    assert!(bag.topic("/reference/L_LowArm").is_err());

    // PAMAP2: one placement of three, its stamps as they are.
    succeed(
        here,
        &[
            "convert",
            &sample("pamap2.dat"),
            "hand.csv",
            "--to",
            "euroc",
            "--placement",
            "hand",
        ],
    );
    let hand = parse_euroc_imu(&fs::read(at("hand.csv")).unwrap(), "hand.csv").unwrap();
    assert_eq!(
        hand.stamps
            .iter()
            .map(|stamp| stamp.nanos)
            .collect::<Vec<_>>(),
        [5_000_000_000, 5_020_000_000]
    );
    refuses(
        here,
        &["convert", &sample("pamap2.dat"), "x.csv"],
        &["several placements; give --placement, one of hand, chest, ankle"],
    );
    refuses(
        here,
        &[
            "convert",
            &sample("pamap2.dat"),
            "x.mcap",
            "--placement",
            "head",
        ],
        &["--placement head: no such placement"],
    );
    refuses(
        here,
        &[
            "convert",
            &sample("pamap2.dat"),
            "x.tum",
            "--placement",
            "hand",
        ],
        &["no reference of hand"],
    );
    refuses(
        here,
        &["convert", &sample("pamap2.dat"), "x.mcap", "--up-axis", "y"],
        &["--up-axis is for motions"],
    );

    // RealWorld: the gyroscope's zip beside the accelerometer's, or named.
    fs::copy(sample("realworld.zip"), at("acc_walking_csv.zip")).unwrap();
    refuses(
        here,
        &["convert", "acc_walking_csv.zip", "x.mcap"],
        &["the gyroscope's is not beside"],
    );
    fs::copy(sample("realworld.zip"), at("gyr_walking_csv.zip")).unwrap();
    succeed(here, &["convert", "acc_walking_csv.zip", "walking.mcap"]);
    succeed(
        here,
        &[
            "convert",
            "acc_walking_csv.zip",
            "same.mcap",
            "--gyroscope",
            "gyr_walking_csv.zip",
        ],
    );
    let bag = BagReader::open(&at("walking.mcap")).unwrap();
    let chest = bag.read::<Imu>("/imu/chest/data_raw").unwrap();
    assert_eq!(
        (chest.len(), chest[0].1.header.stamp.nanos()),
        (6, 1_435_995_800_000_000_000)
    );
    let said = succeed(here, &["compare", "walking.mcap", "same.mcap"]);
    assert!(said.contains("chest") && said.contains("forearm"), "{said}");

    // DIP-IMU's reference poses are a motion.
    succeed(here, &["convert", &sample("dip.pkl"), "dip.npz"]);
    let dip = read_motion(&at("dip.npz"), &MotionOptions::default()).unwrap();
    assert_eq!((dip.frames.len(), dip.rate_hz), (2, 60.0));
    assert!(!names(here).iter().any(|name| name.starts_with("x.")));
}

#[test]
fn a_real_trial_of_broad_becomes_a_recording_that_is_diagnosed() {
    let Some(folder) = common::shared_data() else {
        return;
    };
    let trial = folder
        .join("paired_broad/21_undisturbed_fast_combined.npz")
        .display()
        .to_string();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // A few seconds of movement: all of it takes minutes.
    succeed(
        here,
        &[
            "convert",
            &trial,
            "trial.mcap",
            "--start",
            "60",
            "--duration",
            "12",
        ],
    );
    let said = succeed(here, &["inspect", "trial.mcap"]);
    assert!(
        said.contains("/reference/body") && said.contains("/imu/body/data_raw"),
        "{said}"
    );
    let said = succeed(here, &["diagnose", "trial.mcap", "--out", "diagnosis"]);
    println!("{said}");
    let diagnosis = fs::read_to_string(here.join("diagnosis/diagnosis.json")).unwrap();
    assert!(
        diagnosis.contains("\"body\"") && said.starts_with("body: "),
        "{said}"
    );
}

#[test]
fn poses_of_a_body_in_a_bag_become_a_motion_again() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let at = |name: &str| here.join(name);
    walk(here, 1.0);
    let read = |name: &str| read_motion(&at(name), &MotionOptions::default()).unwrap();
    let same = |a: &str, b: &str, within: f64| {
        let (a, b) = (read(a), read(b));
        assert_eq!(
            (a.frames.len(), (a.rate_hz * 1e3).round()),
            (b.frames.len(), (b.rate_hz * 1e3).round())
        );
        for (a, b) in a.frames.iter().zip(&b.frames) {
            assert!((a.root_position - b.root_position).norm() < within);
            assert!(
                a.world_rotations()
                    .iter()
                    .zip(&b.world_rotations())
                    .all(|(a, b)| a.angle_to(b) < within)
            );
        }
    };
    // From the states that simulate writes beside the IMUs, and from poses alone.
    succeed(here, &["convert", "walk.bvh", "walk.npz"]);
    succeed(here, &["simulate", "walk.bvh", "--out", "whole.mcap"]);
    succeed(here, &["convert", "whole.mcap", "states.npz"]);
    same("walk.npz", "states.npz", 1e-6);
    let said = succeed(here, &["convert", "walk.bvh", "poses.mcap"]);
    assert!(said.contains("a bag of 101 frames"), "{said}");
    succeed(
        here,
        &["convert", "poses.mcap", "again.npz", "--start", "0.2"],
    );
    assert_eq!(read("again.npz").frames.len(), 81);
    succeed(
        here,
        &[
            "convert",
            "poses.mcap",
            "wrist.tum",
            "--joint",
            "left_wrist",
        ],
    );
    succeed(
        here,
        &["convert", "walk.bvh", "known.tum", "--joint", "left_wrist"],
    );
    let [wrist, known] = ["wrist.tum", "known.tum"]
        .map(|name| parse_tum(&fs::read(at(name)).unwrap(), name).unwrap());
    assert!(
        wrist
            .positions
            .iter()
            .zip(&known.positions)
            .all(|(a, b)| (a - b).norm() < 1e-9)
    );

    // Uneven stamps, with a gap of 0.3 s: the rate is the median's, and the gap is not to be
    // trusted.
    let reader = BagReader::open(&at("poses.mcap")).unwrap();
    let mut bag = BagWriter::create(&at("uneven.mcap"), BagOptions::default()).unwrap();
    for (index, (stamp, pose)) in reader
        .read::<SmplPose>("/smpl/pose")
        .unwrap()
        .into_iter()
        .enumerate()
    {
        let jitter = [0, 300_000, -200_000][index % 3];
        let stamp = Stamp::from_nanos(stamp.nanos + jitter);
        if !(40..70).contains(&index) {
            bag.write(
                "/smpl/pose",
                stamp,
                &SmplPose {
                    header: Header::new(stamp.nanos, "world"),
                    ..pose
                },
            )
            .unwrap();
        }
    }
    bag.finish().unwrap();
    succeed(
        here,
        &["convert", "uneven.mcap", "even.mcap", "--to", "amass"],
    );
    let even = read("even.mcap");
    assert!(
        (even.rate_hz - 100.0).abs() < 6.0 && (even.duration_s() - 1.0).abs() < 0.02,
        "{} Hz, {} s",
        even.rate_hz,
        even.duration_s()
    );
    refuses(
        here,
        &["convert", "uneven.mcap", "x.npz", "--person", "7"],
        &["/smpl/pose: no pose of 7; there are bodies 0"],
    );
    refuses(
        here,
        &["convert", "uneven.mcap", "x.npz", "--up-axis", "y"],
        &["--up-axis is for motion files"],
    );
}

#[test]
fn what_cannot_be_converted_is_said_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    walk(folder.path(), 0.2);
    fs::write(at("robot.tum"), write_tum(&swing(0.1))).unwrap();
    fs::write(at("taken.csv"), "mine").unwrap();
    fs::write(at("prose.txt"), "once upon a time").unwrap();
    let before = names(folder.path());
    let here = folder.path();
    refuses(
        here,
        &["convert", "robot.tum", "taken.csv"],
        &["taken.csv: exists already", "--force"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "robot.xyz"],
        &["robot.xyz: the ending", "--to"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "robot.bvh"],
        &["robot.tum: a trajectory cannot become a BVH file"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.csv", "--joint", "head"],
        &["a trajectory has no joint or site head"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.csv", "--topic", "/a"],
        &["--topic chooses from a bag"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.csv", "--start", "1"],
        &["--start is for motions"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.mcap", "--name", "a b"],
        &["--name a b"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "x.mcap", "--imu", "robot.tum"],
        &["robot.tum: a trajectory; --imu takes an IMU series"],
    );
    refuses(
        here,
        &["convert", "walk.bvh", "x.tum"],
        &["walk.bvh: a motion has 24 joints", "--joint"],
    );
    refuses(
        here,
        &["convert", "walk.bvh", "x.tum", "--joint", "tail"],
        &["--joint tail", "left_wrist"],
    );
    refuses(
        here,
        &["convert", "walk.bvh", "x.tum", "--site", "tail"],
        &["--site tail"],
    );
    refuses(
        here,
        &["convert", "walk.bvh", "x.mcap", "--placement", "hand"],
        &["--placement is for recordings of data sets"],
    );
    fs::write(at("trial.hdf5"), b"\x89HDF\r\n\x1a\n\0\0\0\0").unwrap();
    refuses(
        here,
        &["convert", "trial.hdf5", "x.mcap"],
        &["trial.hdf5: HDF5", "save -v7"],
    );
    fs::remove_file(at("trial.hdf5")).unwrap();
    refuses(
        here,
        &["convert", "prose.txt", "x.bvh"],
        &["prose.txt: not a motion file"],
    );
    refuses(
        here,
        &["convert", "absent.bvh", "x.bvh"],
        &["absent.bvh: cannot be read"],
    );
    refuses(
        here,
        &["convert", "robot.tum", "nowhere/x.csv"],
        &["nowhere/x.csv: cannot be written"],
    );
    refuses(
        here,
        &[
            "simulate", "--rigid", "walk.bvh", "--rate", "100", "--out", "x.mcap",
        ],
        &["walk.bvh: not a trajectory"],
    );
    refuses(
        here,
        &[
            "simulate",
            "--rigid",
            "robot.tum",
            "--rate",
            "100",
            "--out",
            "x.mcap",
            "--placement",
            "a b",
        ],
        &["--placement a b"],
    );
    refuses(
        here,
        &["inspect", "walk.bvh", "--motion-rate", "-1"],
        &["--motion-rate -1"],
    );
    assert_eq!(names(here), before);
    assert_eq!(fs::read_to_string(at("taken.csv")).unwrap(), "mine");
    succeed(here, &["convert", "robot.tum", "taken.csv", "--force"]);
    assert_eq!(names(here), before);
    assert!(
        fs::read_to_string(at("taken.csv"))
            .unwrap()
            .starts_with("stamp_ns")
    );
}
