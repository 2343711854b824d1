//! What is written is read again, in order, and the same calls give the same bytes.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use cromosim_bag::{
    BagError, BagOptions, BagReader, BagWriter, Compression, QosProfile, Selection, Topic, cdr,
    write_imu_csv,
};
use cromosim_msgs::RosMessage;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::String as Text;
use cromosim_spatial::Stamp;

use common::{bag, check_samples, imu, stamp};

const ZSTD: BagOptions = BagOptions {
    compression: Compression::Zstd,
    live: false,
    replace: false,
};
const LIVE: BagOptions = BagOptions {
    compression: Compression::None,
    live: true,
    replace: false,
};

#[test]
fn files_and_directories_give_back_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    for (name, options) in [
        ("plain.mcap", BagOptions::default()),
        ("packed.mcap", ZSTD),
        ("live.mcap", LIVE),
        ("folder", BagOptions::default()),
        ("live", LIVE),
    ] {
        let path = folder.path().join(name);
        // Several chunks: one sample takes 356 bytes.
        bag(&path, 6000, options);
        assert_eq!(check_samples(&path), 6000, "{name}");
        let reader = BagReader::open(&path).unwrap();
        assert_eq!(reader.summary().message_count(), 6600);
        assert_eq!(reader.summary().time_range, Some((stamp(0), stamp(5999))));
        let cadence = reader.cadences().unwrap()["/imu/left_wrist/data_raw"];
        assert!((cadence.rate_hz - 100.0).abs() < 1e-9);
        assert_eq!((cadence.gaps, cadence.span_s), (0, 59.99));
        assert_eq!(
            reader.attachment("placements.yaml"),
            Some(b"placements: []\n".as_slice())
        );
        assert_eq!(reader.metadata("cromosim").unwrap()["seed"], "7");
        assert!(
            reader.metadata("rosbag2").unwrap()["serialized_metadata"]
                .contains("message_count: 6600")
        );
        let topic = reader.topic("/imu/left_wrist/data_raw").unwrap();
        assert_eq!(topic.schema_text(), Imu::schema_text());
        assert_eq!(topic.type_hash(), Imu::type_hash());
        assert_eq!(topic.qos(), [QosProfile::reliable(10)]);
    }
    let mut left: Vec<String> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(
        left,
        ["folder", "live", "live.mcap", "packed.mcap", "plain.mcap"],
        "nothing temporary is left"
    );
}

#[test]
fn the_same_calls_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for options in [BagOptions::default(), ZSTD] {
        let replace = BagOptions {
            replace: true,
            ..options
        };
        let (file, directory) = (folder.path().join("a.mcap"), folder.path().join("a"));
        let read = || {
            bag(&file, 3000, replace);
            bag(&directory, 3000, replace);
            [
                fs::read(&file).unwrap(),
                fs::read(directory.join("a_0.mcap")).unwrap(),
                fs::read(directory.join("metadata.yaml")).unwrap(),
            ]
        };
        assert_eq!(read(), read());
    }
}

#[test]
fn messages_come_in_order_of_log_time_however_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mixed.mcap");
    let mut writer = BagWriter::create(&path, BagOptions::default()).unwrap();
    let mut numbers = common::Numbers(99);
    let mut times: Vec<i64> = (0..500).collect();
    for at in (1..times.len()).rev() {
        times.swap(at, numbers.below(at + 1));
    }
    for (count, &index) in times.iter().enumerate() {
        let topic = if index % 2 == 0 { "/even" } else { "/odd" };
        writer
            .write(
                topic,
                stamp(index),
                &Text {
                    data: index.to_string(),
                },
            )
            .unwrap();
        if count % 37 == 0 {
            // Chunks that overlap in time.
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    let reader = BagReader::open(&path).unwrap();
    let read = |selection: &Selection| -> Vec<i64> {
        let texts = reader
            .messages(selection)
            .unwrap()
            .map(|message| message.unwrap().decode::<Text>().unwrap().data);
        texts.map(|text| text.parse().unwrap()).collect()
    };
    assert_eq!(read(&Selection::default()), (0..500).collect::<Vec<_>>());
    assert_eq!(
        read(&Selection::topic("/odd")),
        (0..500).filter(|index| index % 2 == 1).collect::<Vec<_>>()
    );
    let part = Selection {
        topics: None,
        from: Some(stamp(100)),
        until: Some(stamp(110)),
    };
    assert_eq!(read(&part), (100..110).collect::<Vec<_>>());
}

#[test]
fn messages_of_any_type_pass_through_untouched() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("raw.mcap");
    let mut writer = BagWriter::create(&path, BagOptions::default()).unwrap();
    let known = writer
        .add_topic(&Topic::named("/imu", "sensor_msgs/msg/Imu"))
        .unwrap();
    let unknown = writer
        .add_topic(
            &Topic::named("/odd", "odd_msgs/msg/Odd")
                .with_qos(&[QosProfile::reliable(5).best_effort()]),
        )
        .unwrap();
    writer
        .write_payload(known, &cdr::encode(&imu(3)).unwrap(), stamp(4), stamp(3))
        .unwrap();
    writer
        .write_payload(unknown, &[0, 1, 0, 0, 42], stamp(5), stamp(5))
        .unwrap();
    writer.finish().unwrap();
    let reader = BagReader::open(&path).unwrap();
    let messages: Vec<_> = reader
        .messages(&Selection::default())
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(
        (messages[0].log_time, messages[0].publish_time),
        (stamp(4), stamp(3))
    );
    assert_eq!(messages[0].decode::<Imu>().unwrap(), imu(3));
    assert_eq!(messages[1].payload, [0, 1, 0, 0, 42]);
    assert_eq!(messages[1].topic.qos()[0].reliability, "best_effort");
    assert!(matches!(
        messages[1].decode::<Imu>(),
        Err(BagError::WrongType { .. })
    ));
}

#[test]
fn what_a_bag_cannot_hold_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.mcap");
    let mut writer = BagWriter::create(&path, BagOptions::default()).unwrap();
    writer.write("/a", stamp(0), &Text::default()).unwrap();
    assert!(matches!(
        writer.write("/a", stamp(0), &imu(0)),
        Err(BagError::WrongType { .. })
    ));
    assert!(matches!(
        writer.write("/a", Stamp::from_nanos(-1), &Text::default()),
        Err(BagError::BeforeEpoch { nanos: -1, .. })
    ));
    drop(writer);
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        0,
        "an unfinished bag leaves nothing behind"
    );
}

#[test]
fn only_bags_are_replaced_and_only_when_asked() {
    let folder = tempfile::tempdir().unwrap();
    let replace = BagOptions {
        replace: true,
        ..BagOptions::default()
    };
    for name in ["a.mcap", "a"] {
        let path = folder.path().join(name);
        bag(&path, 10, BagOptions::default());
        assert!(matches!(
            BagWriter::create(&path, BagOptions::default()),
            Err(BagError::Exists { .. })
        ));
        bag(&path, 20, replace);
        assert_eq!(check_samples(&path), 20);
    }
    let precious = folder.path().join("thesis");
    fs::create_dir(&precious).unwrap();
    fs::write(precious.join("chapter1.tex"), "…").unwrap();
    assert!(matches!(
        BagWriter::create(&precious, replace),
        Err(BagError::Exists { .. })
    ));
    assert!(precious.join("chapter1.tex").exists());
}

#[test]
fn an_empty_bag_is_a_bag() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["empty.mcap", "empty"] {
        let path = folder.path().join(name);
        BagWriter::create(&path, BagOptions::default())
            .unwrap()
            .finish()
            .unwrap();
        let reader = BagReader::open(&path).unwrap();
        assert_eq!(
            (
                reader.summary().message_count(),
                reader.summary().time_range
            ),
            (0, None)
        );
    }
}

#[test]
fn csv_holds_the_numbers_without_loss() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("imu.mcap");
    let mut writer = BagWriter::create(&path, BagOptions::default()).unwrap();
    let mut raw = imu(1);
    raw.orientation_covariance[0] = -1.0;
    writer.write("/imu", stamp(0), &imu(0)).unwrap();
    writer.write("/imu", stamp(1), &raw).unwrap();
    writer.finish().unwrap();
    let mut text = Vec::new();
    let count = write_imu_csv(
        &BagReader::open(&path).unwrap(),
        "/imu",
        &mut text,
        &folder.path().join("imu.csv"),
    )
    .unwrap();
    let text = String::from_utf8(text).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((count, rows.len()), (2, 3));
    assert!(rows.iter().all(|row| row.len() == 11), "{text}");
    assert_eq!(rows[1][..5], ["1700000000000000000", "0", "0", "0", "1"]);
    assert_eq!(rows[2][..5], ["1700000000010000000", "", "", "", ""]);
    assert_eq!(rows[2][8].parse::<f64>().unwrap(), 0.01_f64.sin());
}

#[test]
fn of_two_that_begin_at_once_one_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for round in 0..100 {
        for name in [format!("bag{round}"), format!("bag{round}.mcap")] {
            let path = folder.path().join(name);
            let both = std::sync::Barrier::new(2);
            let begin = || {
                both.wait();
                BagWriter::create(&path, LIVE)
            };
            let (one, other) = std::thread::scope(|scope| {
                let other = scope.spawn(begin);
                (begin(), other.join().unwrap())
            });
            let (begun, refused): (Vec<_>, Vec<_>) =
                [one, other].into_iter().partition(Result::is_ok);
            assert_eq!(begun.len(), 1, "{}", path.display());
            let refusal = refused.into_iter().next().unwrap().err().unwrap();
            assert!(matches!(refusal, BagError::Exists { .. }), "{refusal}");
            begun.into_iter().next().unwrap().unwrap().finish().unwrap();
            BagReader::open(&path).unwrap();
        }
    }
}
