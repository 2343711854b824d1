//! The readings of real IMUs alone, without a reference.

use std::path::Path;

use cromosim_bag::BagReader;
use cromosim_imu::Reading;
use cromosim_msgs::RosMessage;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_spatial::Stamp;

use crate::datasets::{DatasetFiles, open_dataset};
use crate::placement::names_between;
use crate::rigid::{ImuSeries, RigidContent, parse_rigid};
use crate::{RecordingError, is_bag, read_whole};

/// The readings of one IMU.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StaticReadings {
    /// The placement's name; `body` for a file of one IMU.
    pub name: String,
    /// In order; no stamp twice.
    pub stamps: Vec<Stamp>,
    /// One for each stamp, as it was recorded.
    pub readings: Vec<Reading>,
}

/// The IMUs of a bag (`/imu/NAME/data_raw`, by name), of a recording or of an IMU series. Readings that are NaN or
/// infinite, or not later than the one before, are left out.
///
/// # Errors
/// What is wrong with the file, and [`RecordingError::Unsuitable`] for one without an IMU.
pub fn read_static(path: &Path) -> Result<Vec<StaticReadings>, RecordingError> {
    let unsuitable = |problem: &str| RecordingError::Unsuitable {
        path: path.to_owned(),
        problem: problem.to_owned(),
    };
    if is_bag(path) {
        let reader = BagReader::open(path)?;
        let names = names_between(&reader, "/imu/", "/data_raw", Imu::TYPE_NAME);
        if names.is_empty() {
            return Err(unsuitable(
                "no topic /imu/NAME/data_raw (sensor_msgs/msg/Imu) in it",
            ));
        }
        let read = |name: String| {
            let messages = reader.read::<Imu>(&format!("/imu/{name}/data_raw"))?;
            let mut own = StaticReadings {
                name,
                ..StaticReadings::default()
            };
            for (_, imu) in messages {
                let reading = Reading {
                    specific_force: imu.linear_acceleration.into(),
                    angular_velocity: imu.angular_velocity.into(),
                };
                own.push(Stamp::from_nanos(imu.header.stamp.nanos()), reading);
            }
            Ok(own)
        };
        return names.into_iter().map(read).collect();
    }
    if let Some((_, recording)) = open_dataset(path, &DatasetFiles::default())? {
        let imus = recording.imus.into_iter();
        let all = imus.map(|imu| StaticReadings::of(imu.placement, &imu.series));
        return match all.collect::<Vec<_>>() {
            all if all.is_empty() => Err(unsuitable("a recording without an IMU")),
            all => Ok(all),
        };
    }
    match parse_rigid(&read_whole(path)?, &path.display().to_string())? {
        Some(RigidContent::Imu(series)) => Ok(vec![StaticReadings::of("body".to_owned(), &series)]),
        _ => Err(unsuitable(
            "no IMU in it; expected a bag with /imu/NAME/data_raw, or an IMU series (EuRoC, or a table with a header)",
        )),
    }
}

impl StaticReadings {
    fn of(name: String, series: &ImuSeries) -> Self {
        let mut own = Self {
            name,
            ..Self::default()
        };
        for (stamp, reading) in series.stamps.iter().zip(series.readings()) {
            own.push(*stamp, reading);
        }
        own
    }

    fn push(&mut self, stamp: Stamp, reading: Reading) {
        let values = [reading.specific_force, reading.angular_velocity];
        let is_finite = values
            .iter()
            .flat_map(|it| it.iter())
            .all(|it| it.is_finite());
        if is_finite && self.stamps.last().is_none_or(|last| stamp > *last) {
            self.stamps.push(stamp);
            self.readings.push(reading);
        }
    }
}
