//! Damaged recordings, states in place of a reference, and rest.

use cromosim_bag::{BagOptions, BagReader, BagWriter};
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use nalgebra::Vector3;

use crate::answer::{causes, contract, diagnosis, set};
use crate::common::{cromosim_in, succeed, text};
use crate::found::LEVER_ARM;
use crate::session::{Motion, Random, imus, record, reference, stamp, write};

#[test]
fn one_bad_placement_does_not_hide_the_other() {
    let folder = tempfile::tempdir().unwrap();
    record(
        folder.path(),
        "good.mcap",
        4,
        (0.0, 60.0),
        &[("wrist", LEVER_ARM)],
    );
    let poses = || reference(&Motion::new(4), 0.0, 60.0, (1e-4, 8e-4), &mut Random(9));
    let measured = || imus(&folder.path().join("good.mcap"), "wrist");
    let mut blind = poses();
    // What motion capture writes while it sees nothing, a frame twice, and frames out of order.
    blind[2000..2100]
        .iter_mut()
        .for_each(|message| message.pose.position.x = f64::NAN);
    blind.push(blind[10].clone());
    blind.swap(300, 301);
    let mut stuck = measured();
    stuck
        .iter_mut()
        .for_each(|message| message.angular_velocity.y = 0.0);
    write(
        &folder.path().join("three.mcap"),
        &[
            ("wrist", blind, measured()),
            ("ankle", poses(), stuck),
            ("head", poses(), Vec::new()),
        ],
    );
    let output = cromosim_in(folder.path(), &["diagnose", "three.mcap", "--out", "found"]);
    let (said, warned) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{}", text(&output));
    for part in [
        "100 of 12002 reference poses",
        "1 reference poses repeat",
        "head: no messages on /imu/head/data_raw",
        "ankle: gyro_y never",
    ] {
        assert!(warned.contains(part), "'{part}' is not in: {warned}");
    }
    assert_eq!(
        causes(&diagnosis(folder.path(), "found"), "wrist"),
        set(&["lever_arm"]),
        "{said}"
    );
    assert_eq!(
        diagnosis(folder.path(), "found")["placements"]
            .as_object()
            .unwrap()
            .len(),
        1
    );
    let said = succeed(
        folder.path(),
        &[
            "simulate",
            "--reference",
            "three.mcap",
            "--effects",
            "found/effects.yaml",
            "--out",
            "again.mcap",
        ],
    );
    assert!(
        said.contains("head: no messages") && said.contains("100 of 12002 reference poses"),
        "{said}"
    );
    assert_eq!(
        imus(&folder.path().join("again.mcap"), "wrist").len(),
        measured().len()
    );
}

#[test]
fn states_and_placements_stand_in_for_a_reference() {
    let folder = tempfile::tempdir().unwrap();
    // The walk's poses are exact, and the default scheme would smooth them.
    let exact = [
        "simulate",
        "--walk",
        "--scheme",
        "spline",
        "--out",
        "walk.mcap",
    ];
    succeed(folder.path(), &exact);
    let walk = BagReader::open(&folder.path().join("walk.mcap")).unwrap();
    let mut bag =
        BagWriter::create(&folder.path().join("states.mcap"), BagOptions::default()).unwrap();
    bag.attach(
        "placements.yaml",
        "application/yaml",
        stamp(0.0),
        walk.attachment("placements.yaml").unwrap(),
    )
    .unwrap();
    for (stamp, state) in walk.read::<SmplState>("/smpl/state").unwrap() {
        bag.write("/smpl/state", stamp, &state).unwrap();
    }
    for (stamp, message) in walk.read::<Imu>("/imu/pelvis/data_raw").unwrap() {
        bag.write("/imu/pelvis/data_raw", stamp, &message).unwrap();
    }
    bag.finish().unwrap();
    let said = succeed(
        folder.path(),
        &["diagnose", "states.mcap", "--out", "found"],
    );
    // The demo's devices have constant biases.
    assert_eq!(
        causes(&diagnosis(folder.path(), "found"), "pelvis"),
        set(&["accel_bias", "gyro_bias"]),
        "{said}"
    );
    assert_eq!(
        diagnosis(folder.path(), "found")["placements"]
            .as_object()
            .unwrap()
            .len(),
        1,
        "the others have no IMU: {said}"
    );
}

#[test]
fn ten_minutes_of_rest_have_no_cause() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(5);
    let still = Motion(vec![Vec::new(); 6]);
    let poses = reference(
        &still,
        0.0,
        600.0,
        (1e-4, 0.05_f64.to_radians()),
        &mut random,
    );
    let imu = |k: usize| {
        let (force, rate) = (
            Vector3::new(0.0, 0.0, 9.80665) + random.vector(0.014),
            random.vector(0.0012),
        );
        let covariance = |sigma: f64| {
            [sigma, 0.0, 0.0, 0.0, sigma, 0.0, 0.0, 0.0, sigma].map(|sigma| sigma * sigma)
        };
        Imu {
            header: Header::new(stamp(k as f64 / 100.0).nanos, "wrist_imu"),
            linear_acceleration: force.into(),
            angular_velocity: rate.into(),
            linear_acceleration_covariance: covariance(0.014),
            angular_velocity_covariance: covariance(0.0012),
            ..Imu::default()
        }
    };
    let measured = (0..60_000).map(imu).collect();
    write(
        &folder.path().join("rest.mcap"),
        &[("wrist", poses, measured)],
    );
    let said = succeed(folder.path(), &["diagnose", "rest.mcap", "--out", "found"]);
    let found = diagnosis(folder.path(), "found");
    contract(&found);
    assert_eq!(causes(&found, "wrist"), set(&[]), "{said}");
    let cannot = found["placements"]["wrist"]["unidentifiable"]
        .as_array()
        .unwrap();
    assert!(
        cannot.iter().any(|effect| effect["effect"] == "lever_arm"),
        "rest cannot show a lever arm: {cannot:?}"
    );
}
