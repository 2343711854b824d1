//! Columns: what is written comes back, damage is refused without a panic, other people's tables are
//! read.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;
use std::sync::Arc;

use cromosim_recording::columns::{ColumnsGroup, ColumnsHeader, ColumnsWriter};
use cromosim_recording::datasets::parse_columns;
use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::path::Path;

/// Two people with two placements each, of different lengths.
fn groups() -> Vec<ColumnsGroup> {
    let whose = [("0", "head"), ("0", "wrist"), ("7", "head"), ("7", "wrist")];
    let group = |(index, (person, placement)): (usize, &(&str, &str))| {
        let mut group = ColumnsGroup {
            person: (*person).to_owned(),
            placement: (*placement).to_owned(),
            ..ColumnsGroup::default()
        };
        for row in 0..200 + 50 * index {
            let value = (row as f64 * 0.37 + index as f64).sin();
            let values = [value, 9.81 + value, -value, 1e-4 * value, 20.0 * value, 0.5];
            group.push(1_000_000_000 + 10_000_000 * row as i64, values);
            let activity = ["walking", "standing"][usize::from(row >= 100)];
            let activity = (row % 150 != 7).then(|| activity.to_owned());
            group.activities.push(activity);
        }
        group
    };
    whose.iter().enumerate().map(group).collect()
}

fn written(groups: &[ColumnsGroup]) -> Vec<u8> {
    let header = ColumnsHeader {
        recording: "walk".to_owned(),
        metadata: BTreeMap::from([("seed".to_owned(), "7".to_owned())]),
    };
    let mut bytes = Vec::new();
    let mut writer = ColumnsWriter::new(&mut bytes, Path::new("walk.parquet"), &header).unwrap();
    for group in groups {
        writer.write(&mut group.clone()).unwrap();
    }
    let rows: usize = groups.iter().map(|group| group.stamps.len()).sum();
    assert_eq!(writer.finish().unwrap(), rows as u64);
    bytes
}

#[test]
fn what_is_written_comes_back() {
    let groups = groups();
    let bytes = written(&groups);
    assert_eq!(bytes, written(&groups), "the same bytes each time");
    let recording = parse_columns(bytes, "walk.parquet").unwrap();
    assert_eq!(recording.rate_hz, 100.0);
    let names: Vec<&str> = recording
        .imus
        .iter()
        .map(|imu| imu.placement.as_str())
        .collect();
    let expected = [
        "person_0_head",
        "person_0_wrist",
        "person_7_head",
        "person_7_wrist",
    ];
    assert_eq!(names, expected);
    for (group, imu) in groups.iter().zip(&recording.imus) {
        assert_eq!(imu.rows_left_out, 0);
        let stamps: Vec<i64> = imu.series.stamps.iter().map(|stamp| stamp.nanos).collect();
        assert_eq!(stamps, group.stamps);
        for (row, reading) in imu.series.readings().iter().enumerate() {
            for axis in 0..3 {
                assert_eq!(
                    reading.specific_force[axis] as f32,
                    group.channels[axis][row]
                );
                assert_eq!(
                    reading.angular_velocity[axis] as f32,
                    group.channels[3 + axis][row]
                );
            }
        }
    }
    let activities: Vec<&str> = recording
        .activities
        .iter()
        .map(|it| it.activity.as_str())
        .collect();
    assert_eq!(
        activities,
        ["walking", "standing"],
        "rows without one are passed over"
    );
}

#[test]
fn damage_is_refused_in_one_line() {
    let bytes = written(&groups());
    let (mut refused, mut panicked) = (0, 0);
    common::damaged(&bytes, 20000, |bytes| {
        match std::panic::catch_unwind(|| parse_columns(bytes.to_vec(), "damaged.parquet")) {
            Ok(Ok(recording)) => {
                for imu in &recording.imus {
                    let stamps = &imu.series.stamps;
                    assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]));
                }
            }
            Ok(Err(error)) => {
                let line = error.to_string();
                assert!(
                    line.starts_with("damaged.parquet") && !line.contains('\n'),
                    "{line}"
                );
                refused += 1;
            }
            Err(_) => panicked += 1,
        }
    });
    assert_eq!(panicked, 0, "{refused} refused");
    assert!(refused > 1000, "{refused}");
}

/// A table of somebody else: doubles, only what is needed, empty cells, a stamp out of order.
#[test]
fn a_foreign_table_is_read() {
    let names = ["specific_force", "angular_velocity"];
    let columns = names
        .iter()
        .flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}")));
    let columns: Vec<String> = columns.collect();
    let fields: String = columns
        .iter()
        .map(|it| format!("OPTIONAL DOUBLE {it};"))
        .collect();
    let message = format!("message m {{ REQUIRED INT64 stamp_ns; {fields} }}");
    let schema = Arc::new(parse_message_type(&message).unwrap());
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
    let mut group = file.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let stamps = [10, 20, 15, 30];
    column
        .typed::<Int64Type>()
        .write_batch(&stamps, None, None)
        .unwrap();
    column.close().unwrap();
    while let Some(mut column) = group.next_column().unwrap() {
        let values = [1.5, 2.5, 3.5];
        column
            .typed::<DoubleType>()
            .write_batch(&values, Some(&[1, 1, 1, 0]), None)
            .unwrap();
        column.close().unwrap();
    }
    group.close().unwrap();
    file.close().unwrap();
    let recording = parse_columns(bytes, "foreign.parquet").unwrap();
    let [imu] = recording.imus.as_slice() else {
        panic!("one placement")
    };
    assert_eq!((imu.placement.as_str(), imu.rows_left_out), ("body", 2));
    let forces: Vec<f64> = imu.series.specific_force.iter().map(|it| it.z).collect();
    assert_eq!(forces, [1.5, 2.5]);
}

#[test]
fn a_table_without_readings_is_refused_by_its_columns() {
    let schema = Arc::new(parse_message_type("message m { REQUIRED INT64 time; }").unwrap());
    let mut bytes = Vec::new();
    let file = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
    file.close().unwrap();
    let error = parse_columns(bytes, "other.parquet")
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "other.parquet: stamp_ns: no such column; there are time"
    );
}
