//! What every importer gives.

use std::ops::Range;

use cromosim_body::Joint;
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

use crate::rigid::{ImuSeries, PoseTrajectory};

/// One IMU and where it was worn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlacedImu {
    /// The data set's own name: `L_LowArm`, `hand`, `forearm`.
    pub placement: String,
    /// SMPL's segment that the placement moves with; `None` off the body, and where the data set
    /// does not say the side.
    pub segment: Option<Joint>,
    /// Its readings.
    pub series: ImuSeries,
    /// world_from_sensor as the device estimated it; one a reading, or none at all.
    pub world_from_sensor: Vec<UnitQuaternion<f64>>,
    /// Magnetometer in the sensor's axes, T; one a reading, or none at all.
    pub magnetic_field: Vec<Vector3<f64>>,
    /// Rows without readings of this IMU, or out of the order of time.
    pub rows_left_out: usize,
}

/// A stretch of one activity.
#[derive(Clone, Debug, PartialEq)]
pub struct ActivitySpan {
    /// Its first row.
    pub start: Stamp,
    /// Its last row.
    pub end: Stamp,
    /// Its name.
    pub activity: String,
}

/// Keeps a range; what is empty stays so.
fn cut<T>(values: &mut Vec<T>, range: &Range<usize>) {
    values.truncate(range.end);
    values.drain(..range.start.min(values.len()));
}

/// One recording of a data set, or of a motion capture system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DatasetRecording {
    /// The file.
    pub name: String,
    /// Nominal rate of the readings, Hz.
    pub rate_hz: f64,
    /// By placement, in the file's order.
    pub imus: Vec<PlacedImu>,
    /// Reference poses of bodies or joints, by name; z up.
    pub references: Vec<(String, PoseTrajectory)>,
    /// What was done when, where the data set says it.
    pub activities: Vec<ActivitySpan>,
    /// What a user should know of the file, a line each.
    pub notes: Vec<String>,
}

impl DatasetRecording {
    /// The names of the IMUs, and then of the references without one.
    pub fn placements(&self) -> Vec<&str> {
        let imus = self.imus.iter().map(|imu| imu.placement.as_str());
        let has_imu = |name: &str| self.imus.iter().any(|imu| imu.placement == name);
        let references = self.references.iter().map(|(name, _)| name.as_str());
        imus.chain(references.filter(|name| !has_imu(name)))
            .collect()
    }

    /// The reference of that name.
    pub fn reference(&self, wanted: &str) -> Option<&PoseTrajectory> {
        let mut references = self.references.iter();
        references.find_map(|(name, poses)| (name == wanted).then_some(poses))
    }

    /// From its first reading or pose to its last; `None` where there is none.
    pub fn span(&self) -> Option<(Stamp, Stamp)> {
        let imus = self.imus.iter().map(|imu| &imu.series.stamps);
        let stamps = || {
            imus.clone()
                .chain(self.references.iter().map(|(_, poses)| &poses.stamps))
        };
        let first = stamps().filter_map(|stamps| stamps.first()).min()?;
        Some((*first, *stamps().filter_map(|stamps| stamps.last()).max()?))
    }

    /// What lies between two times, ends included; the count of rows left out stays that of the
    /// file.
    pub fn between(&mut self, from: Stamp, to: Stamp) {
        let inside = |stamps: &[Stamp]| {
            stamps.partition_point(|stamp| *stamp < from)
                ..stamps.partition_point(|stamp| *stamp <= to)
        };
        for imu in &mut self.imus {
            let range = inside(&imu.series.stamps);
            cut(&mut imu.series.stamps, &range);
            cut(&mut imu.series.specific_force, &range);
            cut(&mut imu.series.angular_velocity, &range);
            cut(&mut imu.world_from_sensor, &range);
            cut(&mut imu.magnetic_field, &range);
        }
        for (_, poses) in &mut self.references {
            let range = inside(&poses.stamps);
            cut(&mut poses.stamps, &range);
            cut(&mut poses.positions, &range);
            cut(&mut poses.rotations, &range);
            cut(&mut poses.pose_stds, &range);
        }
        self.activities
            .retain(|span| span.end >= from && span.start <= to);
        for span in &mut self.activities {
            (span.start, span.end) = (span.start.max(from), span.end.min(to));
        }
    }

    /// Adds a row's activity: the last span goes on, or a new one begins.
    pub(super) fn mark(&mut self, stamp: Stamp, activity: &str) {
        match self
            .activities
            .last_mut()
            .filter(|span| span.activity == activity)
        {
            Some(span) => span.end = stamp,
            None => self.activities.push(ActivitySpan {
                start: stamp,
                end: stamp,
                activity: activity.to_owned(),
            }),
        }
    }
}
