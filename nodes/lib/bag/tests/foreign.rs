//! Bags that others wrote, and what is no bag.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use cromosim_bag::{BagError, BagReader};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::String as Text;

use common::{imu, stamp};

/// Length of the specific force, m/s2.
fn force(imu: &Imu) -> f64 {
    let f = imu.linear_acceleration;
    f.x.hypot(f.y).hypot(f.z)
}

/// Recordings that public Python packages wrote: chunks by Zstandard, no rosbag2 record, schemas of
/// their own.
#[test]
fn recordings_of_other_programs_are_read() {
    let Some(cases) = common::cases() else { return };
    for name in ["lever-arm", "none", "time-offset-and-bias"] {
        for file in ["fit.mcap", "check.mcap"] {
            let reader = BagReader::open(&cases.join(name).join(file)).unwrap();
            let topics: Vec<&str> = reader
                .summary()
                .topics
                .iter()
                .map(|counted| counted.topic.name.as_str())
                .collect();
            let placements: Vec<&str> = topics
                .iter()
                .filter_map(|topic| topic.strip_prefix("/reference/"))
                .collect();
            assert!(
                !placements.is_empty() && topics.len() == 2 * placements.len(),
                "{topics:?}"
            );
            let mut count = 0;
            for placement in placements {
                let samples = reader
                    .read::<Imu>(&format!("/imu/{placement}/data_raw"))
                    .unwrap();
                let poses = reader
                    .read::<PoseStamped>(&format!("/reference/{placement}"))
                    .unwrap();
                assert!(
                    samples.iter().map(|(time, _)| time).is_sorted()
                        && poses.iter().map(|(time, _)| time).is_sorted()
                );
                assert!(poses.iter().all(|(_, at)| {
                    nalgebra::UnitQuaternion::try_from(at.pose.orientation).is_ok()
                }));
                // Under gravity, the mean specific force of everyday motion is near g.
                let mean = samples.iter().map(|(_, sample)| force(sample)).sum::<f64>()
                    / samples.len() as f64;
                assert!(
                    (8.0..14.0).contains(&mean),
                    "{name}/{file}: mean specific force {mean} m/s2"
                );
                count += samples.len() + poses.len();
            }
            assert_eq!(
                count as u64,
                reader.summary().message_count(),
                "{name}/{file}"
            );
        }
    }
}

/// Without chunks, index and statistics: messages one after the other, not in order.
#[test]
fn files_without_an_index_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plain.mcap");
    let options = mcap::WriteOptions::new()
        .profile("ros2")
        .use_chunks(false)
        .emit_summary_records(false)
        .emit_summary_offsets(false);
    let mut writer = options.create(fs::File::create(&path).unwrap()).unwrap();
    let schema = writer
        .add_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
        .unwrap();
    let channel = writer
        .add_channel(
            schema,
            "/imu/left_wrist/data_raw",
            "cdr",
            &Default::default(),
        )
        .unwrap();
    for index in [3, 1, 0, 2] {
        let nanos = stamp(index).nanos as u64;
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: nanos,
            publish_time: nanos,
        };
        writer
            .write_to_known_channel(&header, &cromosim_bag::cdr::encode(&imu(index)).unwrap())
            .unwrap();
    }
    writer.finish().unwrap();
    assert_eq!(common::check_samples(&path), 4);
}

/// Chunked and packed by LZ4, without statistics or repeated channels.
#[test]
fn chunks_without_statistics_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lz4.mcap");
    let options = mcap::WriteOptions::new()
        .compression(Some(mcap::Compression::Lz4))
        .chunk_size(Some(2000))
        .emit_summary_records(false);
    let mut writer = options.create(fs::File::create(&path).unwrap()).unwrap();
    let schema = writer
        .add_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
        .unwrap();
    let channel = writer
        .add_channel(
            schema,
            "/imu/left_wrist/data_raw",
            "cdr",
            &Default::default(),
        )
        .unwrap();
    for index in 0..50 {
        let nanos = stamp(index).nanos as u64;
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: nanos,
            publish_time: nanos,
        };
        writer
            .write_to_known_channel(&header, &cromosim_bag::cdr::encode(&imu(index)).unwrap())
            .unwrap();
    }
    writer.finish().unwrap();
    assert_eq!(common::check_samples(&path), 50);
    assert_eq!(
        BagReader::open(&path).unwrap().summary().message_count(),
        50
    );
}

#[test]
fn errors_name_the_file_and_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let message = |name: &str| BagReader::open(&at(name)).unwrap_err().to_string();
    assert!(
        message("absent.mcap")
            .ends_with("absent.mcap: cannot open: No such file or directory (os error 2)")
    );
    fs::write(at("text.mcap"), "HIERARCHY\nROOT Hips\n").unwrap();
    assert!(message("text.mcap").ends_with(
        "text.mcap: not a bag: it starts neither as MCAP nor as SQLite nor as a bag of ROS 1 does"
    ));
    fs::write(at("zero.mcap"), "").unwrap();
    assert!(message("zero.mcap").contains("not a bag"));
    for (folder, metadata, expected) in [
        (
            "yaml",
            "rosbag2_bagfile_information: [",
            "yaml/metadata.yaml: ",
        ),
        (
            "field",
            "rosbag2_bagfile_information:\n  storage_identifier: mcap\n",
            "relative_file_paths",
        ),
        (
            "storage",
            "rosbag2_bagfile_information:\n  storage_identifier: my_storage\n  relative_file_paths: []\n",
            "storage \"my_storage\" is not supported",
        ),
        (
            "gone",
            "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths: [gone_0.mcap]\n",
            "gone_0.mcap: cannot open",
        ),
    ] {
        fs::create_dir(at(folder)).unwrap();
        fs::write(at(folder).join("metadata.yaml"), metadata).unwrap();
        assert!(message(folder).contains(expected), "{}", message(folder));
    }
    common::bag(&at("good.mcap"), 5, Default::default());
    let reader = BagReader::open(&at("good.mcap")).unwrap();
    let error = reader
        .read::<Imu>("/imu/head/data")
        .unwrap_err()
        .to_string();
    assert!(
        error.ends_with(
            "good.mcap: no topic /imu/head/data; it holds /imu/left_wrist/data_raw, /note"
        ),
        "{error}"
    );
    assert!(matches!(
        reader.read::<Text>("/imu/left_wrist/data_raw"),
        Err(BagError::WrongType { .. })
    ));
}
