//! Recordings of data sets become bags.

use std::fs;

use cromosim_bag::BagReader;
use cromosim_motion::{MotionOptions, read_motion};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_recording::rigid::{parse_euroc_imu, parse_tum};

use crate::common::{self, refuses, succeed};
use crate::files::names;

/// A file that the tests of the library read, too.
fn sample(name: &str) -> String {
    let folder = if name.ends_with(".mat") {
        "nodes/lib/recording/tests/data"
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
