//! Schema text, type hashes and bytes on the wire, against values from outside.
#![allow(clippy::unwrap_used)]

use byteorder::LittleEndian;
use cromosim_msgs::builtin_interfaces::Time;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_msgs::geometry_msgs::Quaternion;
use cromosim_msgs::rosbag2_interfaces::{PauseRequest, Seek};
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::Header;
use cromosim_msgs::{RosMessage, RosService, known_type};

/// Hashes that ROS 2 Jazzy publishes for these types.
#[test]
fn type_hashes_are_those_of_ros() {
    let published = [
        (
            "builtin_interfaces/msg/Time",
            "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
        ),
        (
            "diagnostic_msgs/msg/DiagnosticArray",
            "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
        ),
        (
            "sensor_msgs/msg/Imu",
            "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
        ),
        (
            "std_msgs/msg/Header",
            "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
        ),
        (
            "std_msgs/msg/String",
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
        ),
    ];
    for (name, hash) in published {
        assert_eq!(known_type(name).unwrap().type_hash(), hash, "{name}");
    }
}

#[test]
fn a_schema_holds_each_dependency_once() {
    let text = Imu::schema_text();
    let separator = "=".repeat(80);
    let parts: Vec<&str> = text.split(&format!("{separator}\nMSG: ")).collect();
    let names: Vec<&str> = parts[1..]
        .iter()
        .map(|part| part.lines().next().unwrap())
        .collect();
    assert_eq!(
        names,
        [
            "builtin_interfaces/Time",
            "geometry_msgs/Quaternion",
            "geometry_msgs/Vector3",
            "std_msgs/Header"
        ]
    );
    assert!(parts[0].contains("float64[9] orientation_covariance"));
}

#[test]
fn the_halves_of_a_service_are_told_apart() {
    let request = <<Seek as RosService>::Request as RosMessage>::schema_text();
    let response = <<Seek as RosService>::Response as RosMessage>::schema_text();
    assert!(request.contains("builtin_interfaces/Time time") && !request.contains("success"));
    assert!(response.contains("bool success") && !response.contains("Time"));
    assert_eq!(
        known_type("rosbag2_interfaces/srv/IsPaused_Request")
            .unwrap()
            .definition(),
        ""
    );
}

/// Bytes worked out by hand from the rules of CDR: lengths count the closing zero, numbers align to
/// their size.
#[test]
fn bytes_are_cdr() {
    let header = Header {
        stamp: Time { sec: 1, nanosec: 2 },
        frame_id: "ab".to_owned(),
    };
    let bytes = cdr_encoding::to_vec::<_, LittleEndian>(&header).unwrap();
    assert_eq!(bytes, [1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0]);
    let imu = Imu {
        header,
        ..Imu::default()
    };
    // 15 bytes of header, one to align, then 4 + 9 + 3 + 9 + 3 + 9 numbers of 8 bytes.
    assert_eq!(
        cdr_encoding::to_vec::<_, LittleEndian>(&imu).unwrap().len(),
        16 + 37 * 8
    );
    assert_eq!(
        cdr_encoding::to_vec::<_, LittleEndian>(&PauseRequest::default()).unwrap(),
        [0]
    );
}

#[test]
fn states_survive_the_wire() {
    let mut pose = SmplPose {
        header: Header::new(1_700_000_000_123_456_789, "world"),
        confidence: 0.5,
        ..SmplPose::default()
    };
    pose.betas = vec![0.1, -2.0];
    pose.local_rotations[23] = Quaternion {
        x: 0.1,
        y: 0.2,
        z: 0.3,
        w: 0.9,
    };
    let state = SmplState::from(pose.clone());
    let bytes = cdr_encoding::to_vec::<_, LittleEndian>(&state).unwrap();
    let (back, used) = cdr_encoding::from_bytes::<SmplState, LittleEndian>(&bytes).unwrap();
    assert_eq!((&back, used), (&state, bytes.len()));
    assert_eq!(back.local_rotations, pose.local_rotations);
    assert_eq!(back.header.stamp.nanos(), 1_700_000_000_123_456_789);
}

#[test]
fn times_saturate_instead_of_wrapping() {
    assert_eq!(
        Time::from_nanos(-1),
        Time {
            sec: -1,
            nanosec: 999_999_999
        }
    );
    assert_eq!(
        Time::from_nanos(i64::MAX),
        Time {
            sec: i32::MAX,
            nanosec: 999_999_999
        }
    );
    assert_eq!(
        Time::from_nanos(i64::MIN),
        Time {
            sec: i32::MIN,
            nanosec: 0
        }
    );
    for nanos in [
        -1_500_000_001,
        -1,
        0,
        1,
        999_999_999,
        1_700_000_000_000_000_001,
    ] {
        assert_eq!(Time::from_nanos(nanos).nanos(), nanos);
    }
}
