//! What was recorded of placements, as the messages that nodes and commands know:
//! `/reference/NAME`, `/imu/NAME/data_raw` and, where the device gave orientations or has a magnetometer,
//! `/imu/NAME/data` and `/imu/NAME/mag`.

use std::fmt::Write;

use cromosim_bag::{BagError, BagWriter};
use cromosim_msgs::geometry_msgs::{Pose, PoseStamped};
use cromosim_msgs::sensor_msgs::{Imu, MagneticField};
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

use crate::FIRST_STAMP;
use crate::datasets::DatasetRecording;
use crate::rigid::{ImuSeries, PoseTrajectory};

/// What was recorded of one placement.
#[derive(Clone, Copy, Debug)]
pub struct PlacementTrace<'a> {
    /// The placement's name, which its topics and its frame carry.
    pub name: &'a str,
    /// Reference poses of the sensor.
    pub reference: Option<&'a PoseTrajectory>,
    /// Readings of the IMU.
    pub imu: Option<&'a ImuSeries>,
    /// world_from_sensor as the device estimated it, one a reading, or none.
    pub orientations: &'a [UnitQuaternion<f64>],
    /// T, in the sensor's axes, one a reading, or none.
    pub magnetic_field: &'a [Vector3<f64>],
}

impl DatasetRecording {
    /// Every IMU with the reference of its name, and then the references without an IMU.
    pub fn traces(&self) -> Vec<PlacementTrace<'_>> {
        let trace = |name| {
            let imu = self.imus.iter().find(|imu| imu.placement == name);
            PlacementTrace {
                name,
                reference: self.reference(name),
                imu: imu.map(|imu| &imu.series),
                orientations: imu.map_or(&[], |imu| &imu.world_from_sensor),
                magnetic_field: imu.map_or(&[], |imu| &imu.magnetic_field),
            }
        };
        self.placements().into_iter().map(trace).collect()
    }
}

/// Stamp of the earliest pose or reading.
pub fn first_stamp(traces: &[PlacementTrace<'_>]) -> Option<Stamp> {
    let references = traces.iter().filter_map(|trace| trace.reference);
    let imus = traces.iter().filter_map(|trace| trace.imu);
    let firsts = references.filter_map(|poses| poses.stamps.first());
    firsts
        .chain(imus.filter_map(|series| series.stamps.first()))
        .min()
        .copied()
}

/// Seconds by which a data set's stamps are moved so that they begin at [`FIRST_STAMP`]; 0 where
/// they begin later.
pub fn seconds_to_first_stamp(first: Stamp) -> f64 {
    if first < FIRST_STAMP {
        FIRST_STAMP - first
    } else {
        0.0
    }
}

/// Writes everything in order of time, its stamps moved by `shift_s` seconds. Of one time, the
/// placements stand in their order, and poses before readings.
///
/// # Errors
/// What the bag refuses.
pub fn write_traces(
    bag: &mut BagWriter,
    traces: &[PlacementTrace<'_>],
    shift_s: f64,
) -> Result<(), BagError> {
    let writers: Vec<TraceWriter> = traces.iter().map(TraceWriter::new).collect();
    for (stamp, placement, row) in in_order_of_time(traces) {
        writers[placement].write(bag, row, stamp.plus_seconds(shift_s))?;
    }
    Ok(())
}

/// What was done when, as a table of `start_ns,end_ns,activity`, its stamps moved by `shift_s`
/// seconds as those of the bag beside it.
pub fn activities_csv(recording: &DatasetRecording, shift_s: f64) -> String {
    let mut table = "start_ns,end_ns,activity\n".to_owned();
    for span in &recording.activities {
        let (start, end) = (
            span.start.plus_seconds(shift_s).nanos,
            span.end.plus_seconds(shift_s).nanos,
        );
        // Writing into a string cannot fail.
        let _ = writeln!(table, "{start},{end},{}", span.activity);
    }
    table
}

/// A row of a placement's trajectory, or of its readings.
#[derive(Clone, Copy)]
enum Row {
    Pose(usize),
    Reading(usize),
}

fn in_order_of_time(traces: &[PlacementTrace<'_>]) -> Vec<(Stamp, usize, Row)> {
    let mut all = Vec::new();
    for (number, trace) in traces.iter().enumerate() {
        let poses = trace.reference.map_or(&[][..], |poses| &poses.stamps);
        let poses = poses.iter().enumerate();
        all.extend(poses.map(|(index, stamp)| (*stamp, number, Row::Pose(index))));
        let readings = trace.imu.map_or(&[][..], |series| &series.stamps);
        let readings = readings.iter().enumerate();
        all.extend(readings.map(|(index, stamp)| (*stamp, number, Row::Reading(index))));
    }
    // Stable: what is of one time keeps its order.
    all.sort_by_key(|(stamp, ..)| *stamp);
    all
}

/// A placement with the names that its messages go by.
struct TraceWriter<'a> {
    trace: &'a PlacementTrace<'a>,
    reference_topic: String,
    raw_topic: String,
    oriented_topic: String,
    magnetic_topic: String,
    sensor_frame: String,
    world_frame: &'a str,
}

impl<'a> TraceWriter<'a> {
    fn new(trace: &'a PlacementTrace<'a>) -> Self {
        let name = trace.name;
        let world = trace
            .reference
            .map(|poses| poses.frame.as_str())
            .filter(|frame| !frame.is_empty());
        Self {
            trace,
            reference_topic: format!("/reference/{name}"),
            raw_topic: format!("/imu/{name}/data_raw"),
            oriented_topic: format!("/imu/{name}/data"),
            magnetic_topic: format!("/imu/{name}/mag"),
            sensor_frame: format!("{name}_imu"),
            world_frame: world.unwrap_or("world"),
        }
    }

    fn write(&self, bag: &mut BagWriter, row: Row, stamp: Stamp) -> Result<(), BagError> {
        match (row, self.trace.reference, self.trace.imu) {
            (Row::Pose(index), Some(poses), _) => {
                let pose = Pose {
                    position: poses.positions[index].into(),
                    orientation: poses.rotations[index].into(),
                };
                let header = Header::new(stamp.nanos, self.world_frame);
                bag.write(&self.reference_topic, stamp, &PoseStamped { header, pose })
            }
            (Row::Reading(index), _, Some(series)) => {
                let message = imu_message(series, index, stamp, &self.sensor_frame);
                bag.write(&self.raw_topic, stamp, &message)?;
                if let Some(field) = self.trace.magnetic_field.get(index) {
                    let field = MagneticField {
                        header: message.header.clone(),
                        magnetic_field: (*field).into(),
                        ..MagneticField::default()
                    };
                    bag.write(&self.magnetic_topic, stamp, &field)?;
                }
                let Some(orientation) = self.trace.orientations.get(index) else {
                    return Ok(());
                };
                let oriented = Imu {
                    orientation: (*orientation).into(),
                    orientation_covariance: [0.0; 9],
                    ..message
                };
                bag.write(&self.oriented_topic, stamp, &oriented)
            }
            _ => Ok(()),
        }
    }
}

/// Covariances of zeros, which say "unknown" (REP-145): the files do not say how large the noise
/// is.
fn imu_message(series: &ImuSeries, index: usize, stamp: Stamp, frame_id: &str) -> Imu {
    let mut message = Imu {
        header: Header::new(stamp.nanos, frame_id),
        angular_velocity: series.angular_velocity[index].into(),
        linear_acceleration: series.specific_force[index].into(),
        ..Imu::default()
    };
    // REP-145: there is no orientation.
    message.orientation_covariance[0] = -1.0;
    message
}
