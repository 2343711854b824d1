//! Xsens MVN's MVNX as a recording: what its sensors read, as far as the file says it, beside the
//! segments' poses.
//!
//! The file has each sensor's orientation and its acceleration without gravity, both in the world,
//! and each segment's angular velocity. A sensor that is fixed to its segment turns as the segment
//! does, so that in the sensor's axes, with R its world_from_sensor,
//!
//! specific force = R^T (free acceleration - gravity), angular velocity = R^T (the segment's).
//!
//! MVN has taken the sensors' biases out before, and smooths the segments; the sensors' own rates
//! and magnetic fields (in units of their own) are left alone.

use cromosim_body::Joint;
use cromosim_motion::{Mvnx, parse_mvnx};
use cromosim_spatial::Stamp;

use super::capture::{content, placement_name, specific_force};
use super::{DatasetRecording, PlacedImu};
use crate::rigid::table::text;
use crate::rigid::{PoseTrajectory, RigidError};

/// Reads the segments as references and, where the file has what they read, the sensors as IMUs,
/// each by its segment's name.
///
/// # Errors
/// [`RigidError::NotText`], [`RigidError::Content`]; [`RigidError::Motion`], which names the line.
pub fn parse_mvnx_sensors(bytes: &[u8], name: &str) -> Result<DatasetRecording, RigidError> {
    let mvnx = parse_mvnx(text(bytes, name)?, name);
    let mvnx = mvnx.map_err(|error| RigidError::Motion(Box::new(error)))?;
    let stamps = stamps(&mvnx).ok_or_else(|| {
        content(
            name,
            "recDateMSecsSinceEpoch",
            "a time beyond what stamps hold",
        )
    })?;
    let mut notes = vec![
        "a motion of a whole body, too: `cromosim simulate`, and `convert` into .npz, .bvh or .trc, take it as one".to_owned(),
    ];
    let has_readings = !mvnx.sensor_orientations.is_empty()
        && !mvnx.sensor_free_accelerations.is_empty()
        && !mvnx.angular_velocities.is_empty();
    let mut imus = Vec::new();
    if has_readings {
        let sensors = mvnx.sensors.iter().enumerate();
        imus.extend(sensors.filter_map(|(sensor, label)| imu(&mvnx, sensor, label, &stamps)));
        notes.push("readings are rebuilt from free accelerations, orientations and the segments' angular velocities".to_owned());
    } else {
        notes.push("no readings: sensorFreeAcceleration, sensorOrientation and angularVelocity are needed; export with sensor data".to_owned());
    }
    let segments = mvnx.segments.iter().enumerate();
    let references = segments.map(|(segment, label)| {
        let width = mvnx.segments.len();
        let own = |frame| frame * width + segment;
        let frames = 0..mvnx.frames.len();
        let trajectory = PoseTrajectory {
            stamps: stamps.clone(),
            positions: frames
                .clone()
                .map(|frame| mvnx.positions[own(frame)])
                .collect(),
            rotations: frames.map(|frame| mvnx.orientations[own(frame)]).collect(),
            frame: "world".to_owned(),
            ..PoseTrajectory::default()
        };
        (placement_name(label), trajectory)
    });
    Ok(DatasetRecording {
        name: name.to_owned(),
        rate_hz: mvnx.rate_hz,
        references: references.collect(),
        imus,
        notes,
        ..DatasetRecording::default()
    })
}

/// From 1970 where the file says when it began, else from the first frame.
fn stamps(mvnx: &Mvnx) -> Option<Vec<Stamp>> {
    let start = mvnx.start_ms.unwrap_or(0).checked_mul(1_000_000)?;
    let stamp = |frame: &u32| {
        let passed = Stamp::from_seconds(f64::from(*frame) / mvnx.rate_hz);
        start.checked_add(passed.nanos).map(Stamp::from_nanos)
    };
    mvnx.frames.iter().map(stamp).collect()
}

/// What a sensor read; none where no segment has its label.
fn imu(mvnx: &Mvnx, sensor: usize, label: &str, stamps: &[Stamp]) -> Option<PlacedImu> {
    let segment = mvnx.segments.iter().position(|own| own == label)?;
    let (segments, sensors) = (mvnx.segments.len(), mvnx.sensors.len());
    let mut imu = PlacedImu {
        placement: placement_name(label),
        segment: joint(label),
        ..PlacedImu::default()
    };
    for (frame, stamp) in stamps.iter().enumerate() {
        let own = frame * sensors + sensor;
        let world_from_sensor = mvnx.sensor_orientations[own];
        let angular_velocity_in_world = mvnx.angular_velocities[frame * segments + segment];
        imu.series.push(
            *stamp,
            specific_force(world_from_sensor, mvnx.sensor_free_accelerations[own]),
            world_from_sensor.inverse() * angular_velocity_in_world,
        );
        imu.world_from_sensor.push(world_from_sensor);
    }
    Some(imu)
}

/// The segment of SMPL that one of MVN's moves with.
fn joint(label: &str) -> Option<Joint> {
    Some(match label {
        "Pelvis" => Joint::Pelvis,
        "T8" => Joint::Spine3,
        "Head" => Joint::Head,
        "RightShoulder" => Joint::RightCollar,
        "RightUpperArm" => Joint::RightShoulder,
        "RightForeArm" => Joint::RightElbow,
        "RightHand" => Joint::RightWrist,
        "LeftShoulder" => Joint::LeftCollar,
        "LeftUpperArm" => Joint::LeftShoulder,
        "LeftForeArm" => Joint::LeftElbow,
        "LeftHand" => Joint::LeftWrist,
        "RightUpperLeg" => Joint::RightHip,
        "RightLowerLeg" => Joint::RightKnee,
        "RightFoot" => Joint::RightAnkle,
        "LeftUpperLeg" => Joint::LeftHip,
        "LeftLowerLeg" => Joint::LeftKnee,
        "LeftFoot" => Joint::LeftAnkle,
        _ => return None,
    })
}
