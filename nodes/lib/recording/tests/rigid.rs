//! Files of rigid bodies: exact round trips, verdicts on bad rows, recognition, and damage.
#![allow(clippy::unwrap_used)]

mod common;

use cromosim_recording::rigid::{
    EurocGroundTruth, ImuSeries, PoseTrajectory, RigidError, RigidFormat, parse_euroc_ground_truth,
    parse_euroc_imu, parse_imu_csv, parse_pose_csv, parse_rigid, parse_tum, sniff_rigid,
    write_euroc_ground_truth, write_euroc_imu, write_imu_csv, write_pose_csv, write_tum,
};
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn vector(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| {
        (random.random::<f64>() - 0.5) * 10.0_f64.powi((random.random::<f64>() * 12.0) as i32 - 9)
    })
}

/// Stamps of today with odd nanoseconds, numbers of all sizes.
fn trajectory(frame: &str) -> PoseTrajectory {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut trajectory = PoseTrajectory {
        frame: frame.to_owned(),
        ..PoseTrajectory::default()
    };
    for index in 0..500_i64 {
        trajectory.stamps.push(Stamp::from_nanos(
            1_700_000_000_123_456_789 + index * 4_999_999 + index % 7,
        ));
        trajectory.positions.push(vector(&mut random));
        trajectory
            .rotations
            .push(UnitQuaternion::from_scaled_axis(vector(&mut random)));
    }
    trajectory
}

fn imu() -> ImuSeries {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let stamps = trajectory("").stamps;
    let list = |random: &mut ChaCha8Rng| stamps.iter().map(|_| vector(random)).collect();
    ImuSeries {
        specific_force: list(&mut random),
        angular_velocity: list(&mut random),
        stamps,
    }
}

fn ground_truth() -> EurocGroundTruth {
    let imu = imu();
    EurocGroundTruth {
        trajectory: trajectory(""),
        velocities: imu.specific_force.clone(),
        gyroscope_biases: imu.angular_velocity,
        accelerometer_biases: imu.specific_force,
    }
}

#[test]
fn everything_comes_back_bit_for_bit() {
    let tum = write_tum(&trajectory(""));
    assert_eq!(parse_tum(tum.as_bytes(), "a.txt").unwrap(), trajectory(""));
    assert_eq!(write_tum(&parse_tum(tum.as_bytes(), "a.txt").unwrap()), tum);
    for frame in ["", "map", "odd, \"frame\""] {
        let csv = write_pose_csv(&trajectory(frame));
        assert_eq!(
            parse_pose_csv(csv.as_bytes(), "a.csv").unwrap(),
            trajectory(frame)
        );
    }
    let truth = write_euroc_ground_truth(&ground_truth());
    assert_eq!(
        parse_euroc_ground_truth(truth.as_bytes(), "a.csv").unwrap(),
        ground_truth()
    );
    let poses_only = EurocGroundTruth {
        trajectory: trajectory(""),
        ..EurocGroundTruth::default()
    };
    assert_eq!(
        parse_euroc_ground_truth(write_euroc_ground_truth(&poses_only).as_bytes(), "a.csv")
            .unwrap(),
        poses_only
    );
    assert_eq!(
        parse_euroc_imu(write_euroc_imu(&imu()).as_bytes(), "a.csv").unwrap(),
        imu()
    );
}

#[test]
fn formats_are_told_by_content() {
    let cases = [
        (write_tum(&trajectory("")), RigidFormat::Tum),
        ("1.5 0 0 0 0 0 0 1\n".to_owned(), RigidFormat::Tum),
        (write_euroc_ground_truth(&ground_truth()), RigidFormat::EurocGroundTruth),
        (write_euroc_imu(&imu()), RigidFormat::EurocImu),
        ("1403636579758555392,-0.099,0.147,0.02,8.1,-0.37,-2.4\n".to_owned(), RigidFormat::EurocImu),
        (write_pose_csv(&trajectory("map")), RigidFormat::PoseCsv),
        ("header.stamp.sec;header.stamp.nanosec;pose.position.x;pose.position.y;pose.position.z;pose.orientation.x;pose.orientation.y;pose.orientation.z;pose.orientation.w\n".to_owned(), RigidFormat::PoseCsv),
    ];
    for (content, expected) in cases {
        assert_eq!(
            sniff_rigid(content.as_bytes()),
            Some(expected),
            "{}",
            &content[..40.min(content.len())]
        );
    }
    for other in [
        "",
        "HIERARCHY\nROOT hips\n",
        "a,b,c\n1,2,3\n",
        "{\"people\": []}",
        "1 2 3\n",
    ] {
        assert_eq!(sniff_rigid(other.as_bytes()), None, "{other}");
    }
}

#[test]
fn headers_of_many_hands_are_understood() {
    let pose = "0.1,0.2,0.3,0,0,0.6,0.8";
    let expected_nanos = 1_700_000_000_250_000_000;
    for (header, time) in [
        ("time,x,y,z,qx,qy,qz,qw", "1700000000.25"),
        (
            "Time [ms], pos_x [m], pos_y [m], pos_z [m], quat_x, quat_y, quat_z, quat_w",
            "1700000000250",
        ),
        ("timestamp,tx,ty,tz,q_x,q_y,q_z,q_w", "1700000000250000"),
        ("stamp_ns,px,py,pz,qx,qy,qz,qw", "1700000000250000000"),
        (
            "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z,field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w",
            "1700000000250000000",
        ),
        (
            ".header.stamp.secs,.header.stamp.nsecs,.pose.position.x,.pose.position.y,.pose.position.z,.pose.orientation.x,.pose.orientation.y,.pose.orientation.z,.pose.orientation.w",
            "1700000000,250000000",
        ),
    ] {
        for delimiter in [",", ";", "\t"] {
            let content = format!("{header}\n{time},{pose}\n").replace(',', delimiter);
            let read = parse_pose_csv(content.as_bytes(), "a.csv")
                .unwrap_or_else(|error| panic!("{header}: {error}"));
            assert_eq!(read.stamps[0].nanos, expected_nanos, "{header}");
            assert_eq!(read.positions[0], Vector3::new(0.1, 0.2, 0.3));
            assert!(
                (read.rotations[0].w - 0.8).abs() < 1e-15
                    && (read.rotations[0].k - 0.6).abs() < 1e-15
            );
        }
    }
    let millimetres = "t [s],x [mm],y [mm],z [mm],qx,qy,qz,qw\n0.5,100,200,300,0,0,0,1\n";
    let read = parse_pose_csv(millimetres.as_bytes(), "a.csv").unwrap();
    assert!((read.positions[0] - Vector3::new(0.1, 0.2, 0.3)).norm() < 1e-15);
}

#[test]
fn bad_rows_get_a_verdict_with_line_and_column() {
    let tum = |text: &str| parse_tum(text.as_bytes(), "a.txt").unwrap_err().to_string();
    assert_eq!(
        tum("# c\n1 0 0 0 0 0 0 1\n2 0 0 x 0 0 0 1\n"),
        "a.txt, line 3, column 4: expected a finite number, found \"x\""
    );
    assert!(
        tum("1 0 0 0 0 0 0\n")
            .contains("line 1: expected 8 (time, tx ty tz, qx qy qz qw) columns, found 7")
    );
    assert!(
        tum("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n")
            .contains("line 2: stamp 1000000000 ns is not after the 2000000000 ns")
    );
    assert!(tum("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n").contains("remove repeated"));
    assert!(tum("2 0 0 0 0 0 0 0.9\n").contains("the quaternion has length 0.9"));
    assert!(tum("2 0 inf 0 0 0 0 1\n").contains("column 3"));
    assert!(tum("99999999999 0 0 0 0 0 0 1\n").contains("column 1: expected a time"));
    assert!(tum("# nothing\n").contains("no rows"));
    assert!(
        parse_tum(b"1 0 0 0 \xff", "a.txt")
            .unwrap_err()
            .to_string()
            .contains("byte 8")
    );
    let slightly_off = parse_tum(b"2 0 0 0 0.0 0.0 0.6001 0.8\n", "a.txt").unwrap();
    assert!(
        (slightly_off.rotations[0].norm() - 1.0).abs() < 1e-15,
        "printed digits are normalised"
    );

    let csv = |text: &str| {
        parse_pose_csv(text.as_bytes(), "a.csv")
            .unwrap_err()
            .to_string()
    };
    assert!(csv("time,x,y,z,qx,qy,qz\n").contains("line 1: the header names no orientation w"));
    assert!(csv("x,y,z,qx,qy,qz,qw\n").contains("names no time"));
    assert!(csv("time,x,y,z,qx,qy,qz,qw\n1,2,3\n").contains("line 2"));
    assert!(
        csv("time,x,y,z,qx,qy,qz,qw\n1,2,3,4,0,0,0,1\n2,2,3,,0,0,0,1\n")
            .contains("line 3, column 4")
    );
    let windows = "time,x,y,z,qx,qy,qz,qw\r\n1,2,3,4,0,0,0,1\r\n\r\n2,2,3,,0,0,0,1\r\n";
    assert!(
        csv(windows).contains("line 4, column 4"),
        "{}",
        csv(windows)
    );
    let imu = parse_euroc_imu(b"#t\n1,2,3\n", "data.csv")
        .unwrap_err()
        .to_string();
    assert!(imu.contains("data.csv, line 2: expected 7"), "{imu}");
    let truth = parse_euroc_ground_truth(b"1,0,0,0,1,0,0,0\n2,0,0,0,1,0,0,0,1\n", "data.csv")
        .unwrap_err()
        .to_string();
    assert!(truth.contains("line 2: expected 8"), "{truth}");
}

fn assert_sound_times(stamps: &[Stamp], lists: &[&[Vector3<f64>]]) {
    assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]));
    for list in lists {
        assert_eq!(list.len(), stamps.len());
        assert!(list.iter().flatten().all(|value| value.is_finite()));
    }
}

fn assert_sound_poses(poses: &PoseTrajectory) {
    assert_sound_times(&poses.stamps, &[&poses.positions]);
    assert_eq!(poses.rotations.len(), poses.stamps.len());
    let is_unit = |rotation: &UnitQuaternion<f64>| (rotation.norm() - 1.0).abs() < 1e-9;
    assert!(poses.rotations.iter().all(is_unit));
}

fn assert_sound_readings(series: &ImuSeries) {
    assert_sound_times(
        &series.stamps,
        &[&series.specific_force, &series.angular_velocity],
    );
}

fn assert_sound_truth(truth: &EurocGroundTruth) {
    assert_sound_poses(&truth.trajectory);
    for list in [
        &truth.velocities,
        &truth.gyroscope_biases,
        &truth.accelerometer_biases,
    ] {
        if !list.is_empty() {
            assert_sound_times(&truth.trajectory.stamps, &[list]);
        }
    }
}

/// Whether the file was taken; what was taken is sound, and what was not is refused by name.
fn taken<T>(read: Result<T, RigidError>, assert_sound: fn(&T)) -> bool {
    match read {
        Ok(content) => {
            assert_sound(&content);
            true
        }
        Err(error) => {
            assert!(error.to_string().starts_with("x"), "{error}");
            false
        }
    }
}

#[test]
fn damaged_files_are_refused_by_name_or_hold_sound_values() {
    let take = |bytes: &[u8]| {
        let unknown = sniff_rigid(bytes).is_none();
        assert!(parse_rigid(bytes, "x").is_ok_and(|read| read.is_none()) == unknown);
        [
            taken(parse_tum(bytes, "x"), assert_sound_poses),
            taken(parse_pose_csv(bytes, "x"), assert_sound_poses),
            taken(parse_euroc_imu(bytes, "x"), assert_sound_readings),
            taken(parse_euroc_ground_truth(bytes, "x"), assert_sound_truth),
        ]
    };
    // Whole lines, as half of one is damage already.
    let cut = |text: String| {
        let end = text[..2000].rfind('\n').unwrap();
        text.as_bytes()[..=end].to_vec()
    };
    let samples = [
        cut(write_tum(&trajectory("map"))),
        cut(write_pose_csv(&trajectory("map"))),
        cut(write_euroc_imu(&imu())),
        cut(write_euroc_ground_truth(&ground_truth())),
    ];
    for (own, sample) in samples.iter().enumerate() {
        let mut counts = [0; 2];
        common::damaged(sample, 400, |bytes| {
            counts[usize::from(take(bytes)[own])] += 1;
        });
        println!("{own}: {counts:?}");
        let [refused, taken] = counts;
        assert!(refused > 100 && taken > 10, "{own}: {counts:?}");
    }
}

#[test]
fn readings_come_back_from_a_table_and_other_names_are_known() {
    let ours = "stamp_ns,orientation_w,angular_velocity_x,angular_velocity_y,angular_velocity_z,linear_acceleration_x,linear_acceleration_y,linear_acceleration_z\n\
                5,,0.1,0.2,0.3,1,2,9.8\n7,,0.1,0.2,0.25,1,2,9.75\n";
    let other = "time [ns];acc_x;acc_y;acc_z;gyr_x;gyr_y;gyr_z\n5;1;2;9.8;0.1;0.2;0.3\n7;1;2;9.75;0.1;0.2;0.25\n";
    let series = parse_imu_csv(ours.as_bytes(), "a.csv").unwrap();
    assert_eq!(series, parse_imu_csv(other.as_bytes(), "b.csv").unwrap());
    assert_eq!(
        series,
        parse_imu_csv(write_imu_csv(&series).as_bytes(), "c.csv").unwrap()
    );
    assert_eq!(series.angular_velocity[1], Vector3::new(0.1, 0.2, 0.25));
    for text in [ours, other, &write_imu_csv(&series)] {
        assert_eq!(
            sniff_rigid(text.as_bytes()),
            Some(RigidFormat::ImuCsv),
            "{text}"
        );
    }
    let poses = "stamp_ns,x,y,z,qx,qy,qz,qw,angular_velocity_x,acceleration_x\n";
    assert_eq!(sniff_rigid(poses.as_bytes()), Some(RigidFormat::PoseCsv));
    let error = parse_imu_csv(b"stamp,acc_x,acc_y,acc_z\n1,2,3,4\n", "d.csv")
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with(
            "d.csv, line 1: the header names no angular velocity (gyro) x; it has stamp"
        ),
        "{error}"
    );
    assert!(
        parse_imu_csv(
            b"t,a_x,a_y,a_z,w_x,w_y,w_z\n1,2,3,4,5,6,7\n1,2,3,4,5,6,7\n",
            "e.csv"
        )
        .unwrap_err()
        .to_string()
        .contains("line 3")
    );
}
