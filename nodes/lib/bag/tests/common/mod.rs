//! Bags to test with.
#![allow(dead_code, clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cromosim_bag::{BagOptions, BagReader, BagWriter};
use cromosim_msgs::geometry_msgs::Vector3;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::std_msgs::{Header, String as Text};
use cromosim_spatial::Stamp;

/// Where the samples of this project lie, or none where they are not at hand.
pub fn cases() -> Option<PathBuf> {
    let samples = std::env::var_os("CROMOSIM_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../../shared/data"),
        PathBuf::from,
    );
    let cases = samples.join("../cases");
    if cases.is_dir() {
        return Some(cases);
    }
    assert!(
        std::env::var_os("CROMOSIM_REQUIRE_ALL").is_none_or(|all| all != "1"),
        "{}: not there",
        cases.display()
    );
    // Past the test harness, which swallows what passing tests print.
    let _ = std::io::Write::write_all(
        &mut std::io::stderr(),
        format!("skipped: no sample recordings in {}\n", cases.display()).as_bytes(),
    );
    None
}

/// Nanoseconds of the `index`th sample at 100 Hz.
pub fn stamp(index: i64) -> Stamp {
    Stamp::from_nanos(1_700_000_000_000_000_000 + index * 10_000_000)
}

/// A sample that differs from every other one.
pub fn imu(index: i64) -> Imu {
    let value = index as f64;
    Imu {
        header: Header::new(stamp(index).nanos, "left_wrist_imu"),
        angular_velocity: Vector3 {
            x: value,
            y: 0.1 * value,
            z: -value,
        },
        linear_acceleration: Vector3 {
            x: (0.01 * value).sin(),
            y: 1.0 / (value + 1.0),
            z: 9.80665,
        },
        ..Imu::default()
    }
}

/// Fills a bag with `count` samples on two topics, an attachment and a metadata record.
pub fn fill(writer: &mut BagWriter, count: i64) {
    let seed = BTreeMap::from([("seed".to_owned(), "7".to_owned())]);
    writer.write_metadata("cromosim", seed).unwrap();
    writer
        .attach(
            "placements.yaml",
            "application/yaml",
            stamp(0),
            b"placements: []\n",
        )
        .unwrap();
    for index in 0..count {
        writer
            .write("/imu/left_wrist/data_raw", stamp(index), &imu(index))
            .unwrap();
        if index % 10 == 0 {
            writer
                .write(
                    "/note",
                    stamp(index),
                    &Text {
                        data: format!("sample {index}"),
                    },
                )
                .unwrap();
        }
    }
}

/// A finished bag of `count` samples.
pub fn bag(path: &Path, count: i64, options: BagOptions) {
    let mut writer = BagWriter::create(path, options).unwrap();
    fill(&mut writer, count);
    writer.finish().unwrap();
}

/// Checks that the IMU topic holds the first samples, each as it was written, and says how many.
pub fn check_samples(path: &Path) -> i64 {
    let reader = BagReader::open(path).unwrap();
    if reader.topic("/imu/left_wrist/data_raw").is_err() {
        return 0;
    }
    let samples = reader.read::<Imu>("/imu/left_wrist/data_raw").unwrap();
    for (index, (time, sample)) in samples.iter().enumerate() {
        assert_eq!((*time, sample), (stamp(index as i64), &imu(index as i64)));
    }
    samples.len() as i64
}

/// Numbers for mutations, the same ones every time (xorshift; Marsaglia 2003).
pub struct Numbers(pub u64);

impl Numbers {
    /// A number below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit as u64) as usize
    }
}
