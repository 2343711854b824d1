//! Bags in other storages than MCAP, written by rosbags (`data/make.py`): SQLite, packed by file and by
//! message, and ROS 1's.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use cromosim_bag::{BagError, BagReader, Message, Selection};
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_spatial::Stamp;

const START: i64 = 1_700_000_000_000_000_000;
const PERIOD: i64 = 10_000_000;

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn read_all(reader: &BagReader, selection: &Selection) -> Vec<Message> {
    reader
        .messages(selection)
        .unwrap()
        .map(Result::unwrap)
        .collect()
}

/// What all samples hold.
fn holds_the_samples(path: &Path) {
    let reader = BagReader::open(path).unwrap_or_else(|error| panic!("{error}"));
    let summary = reader.summary();
    let mut counts: Vec<(&str, &str, u64)> = summary
        .topics
        .iter()
        .map(|counted| {
            let topic = &counted.topic;
            (
                topic.name.as_str(),
                topic.type_name.as_str(),
                counted.message_count,
            )
        })
        .collect();
    counts.sort_unstable();
    assert_eq!(
        counts,
        [
            ("/imu/wrist/data_raw", "sensor_msgs/msg/Imu", 20),
            ("/odd", "demo_msgs/msg/Odd", 4),
            ("/reference/wrist", "geometry_msgs/msg/PoseStamped", 20),
        ],
        "{}",
        path.display()
    );
    let (first, last) = summary.time_range.unwrap();
    assert_eq!((first.nanos, last.nanos), (START, START + 19 * PERIOD));
    for (k, (time, imu)) in (0i32..).zip(reader.read::<Imu>("/imu/wrist/data_raw").unwrap()) {
        assert_eq!(time.nanos, START + i64::from(k) * PERIOD);
        assert_eq!(imu.header.frame_id, "wrist_imu");
        assert_eq!(imu.header.stamp.nanosec, k.unsigned_abs() * 10_000_000);
        assert_eq!(imu.angular_velocity.x, 0.5 * f64::from(k));
        assert_eq!(imu.linear_acceleration.z, 9.8);
        assert_eq!(imu.linear_acceleration_covariance[8], 8.0);
    }
    let poses = reader.read::<PoseStamped>("/reference/wrist").unwrap();
    assert_eq!((poses.len(), poses[19].1.pose.position.x), (20, 19.0));
    assert_eq!(poses[3].1.pose.orientation.w, 0.8);
    let times: Vec<Stamp> = read_all(&reader, &Selection::default())
        .iter()
        .map(|message| message.log_time)
        .collect();
    assert!(times.len() == 44 && times.is_sorted());
}

#[test]
fn every_storage_holds_the_same() {
    for name in [
        "sqlite",
        "sqlite/sqlite.db3",
        "sqlite_files",
        "sqlite_messages",
        "sqlite_messages/sqlite_messages.db3",
        "plain.bag",
        "bz2.bag",
        "lz4.bag",
    ] {
        holds_the_samples(&sample(name));
    }
}

/// rosbags wrote the SQLite bag's messages itself: every field type of ROS 1 comes to the same bytes.
#[test]
fn messages_of_ros1_become_the_bytes_of_ros2() {
    let [ros2, ros1] = ["sqlite", "bz2.bag"].map(|name| BagReader::open(&sample(name)).unwrap());
    for topic in ["/odd", "/imu/wrist/data_raw", "/reference/wrist"] {
        let [expected, found] =
            [&ros2, &ros1].map(|reader| read_all(reader, &Selection::topic(topic)));
        assert_eq!(expected.len(), found.len());
        for (expected, found) in expected.iter().zip(&found) {
            assert_eq!(expected.payload, found.payload, "{topic}");
        }
    }
    let schema = ros1.topic("/odd").unwrap().schema_text().to_owned();
    for line in [
        "builtin_interfaces/Time at",
        "builtin_interfaces/Duration[] spans",
        "MSG: std_msgs/Header",
    ] {
        assert!(schema.contains(line), "{line}: {schema}");
    }
    assert!(!schema.contains("seq"), "{schema}");
}

#[test]
fn selections_and_namespaces_hold_in_every_storage() {
    let selection = Selection {
        topics: Some(vec!["/imu/wrist/data_raw".to_owned()]),
        from: Some(Stamp {
            nanos: START + 5 * PERIOD,
        }),
        until: Some(Stamp {
            nanos: START + 8 * PERIOD,
        }),
    };
    for name in ["sqlite", "sqlite_files", "plain.bag"] {
        let reader = BagReader::open(&sample(name)).unwrap();
        let times: Vec<i64> = read_all(&reader, &selection)
            .iter()
            .map(|message| (message.log_time.nanos - START) / PERIOD)
            .collect();
        assert_eq!(times, [5, 6, 7], "{name}");
        let inside = reader.within("/imu/wrist");
        assert_eq!(inside.summary().topics.len(), 1);
        let seen = read_all(&inside, &Selection::default());
        assert!(seen.len() == 20 && seen.iter().all(|message| message.topic.name == "/data_raw"));
    }
}

#[test]
fn damage_is_said_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(sample("plain.bag")).unwrap();
    let cut = folder.path().join("cut.bag");
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let error = BagReader::open(&cut).unwrap_err();
    assert!(
        matches!(&error, BagError::Ros1 { at, .. } if *at > 0)
            && error.to_string().contains("cut off"),
        "{error}"
    );
    let database = folder.path().join("cut.db3");
    let bytes = fs::read(sample("sqlite/sqlite.db3")).unwrap();
    fs::write(&database, &bytes[..5000]).unwrap();
    let error = BagReader::open(&database).unwrap_err();
    assert!(
        matches!(error, BagError::Database { .. }) && error.to_string().contains("cut.db3"),
        "{error}"
    );
}

/// Neither a panic nor gigabytes, whatever stands in the file.
#[test]
fn mutated_bags_of_ros1_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mutated.bag");
    for name in ["plain.bag", "bz2.bag", "lz4.bag"] {
        let bytes = fs::read(sample(name)).unwrap();
        for step in 0..300 {
            let mut mutated = bytes.clone();
            // A hash spreads places and values.
            let hash = (step as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let at = 13 + (hash >> 20) as usize % (bytes.len() - 13);
            mutated[at] = (hash >> 8) as u8;
            fs::write(&path, &mutated).unwrap();
            if let Ok(reader) = BagReader::open(&path) {
                let _: Vec<_> = reader.messages(&Selection::default()).unwrap().collect();
            }
        }
    }
}
