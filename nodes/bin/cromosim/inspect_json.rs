//! `cromosim inspect --json`: the same as its words, as data. Units are in the keys.

use std::path::Path;

use cromosim_bag::BagReader;
use cromosim_body::Joint;
use cromosim_motion::{PoseAxes, SmplMotion};
use cromosim_recording::datasets::{DatasetFormat, DatasetRecording};
use cromosim_recording::inspect::{
    BodyInspection, Inspection, PersonInspection, PosesInspection, RigidExtent, RigidInspection,
    path_length,
};
use cromosim_recording::rigid::RigidFormat;
use serde_json::{Map, Value, json};

/// What is in a file, as one object.
pub fn of(path: &Path, found: &Inspection) -> anyhow::Result<Value> {
    let (kind, of_kind) = match found {
        Inspection::Bag(reader) => ("bag", bag(reader)?),
        Inspection::Recording(format, recording) => ("recording", dataset(*format, recording)),
        Inspection::Rigid(found) => ("rigid", rigid(found)),
        Inspection::Body(found) => ("body", body(found)),
        Inspection::Poses(found) => ("poses", poses(found)),
        Inspection::Motion(found) => ("motion", motion(found)),
    };
    let mut object = Map::from_iter([
        ("path".to_owned(), json!(path.display().to_string())),
        ("kind".to_owned(), json!(kind)),
    ]);
    if let Value::Object(fields) = of_kind {
        object.extend(fields);
    }
    Ok(Value::Object(object))
}

fn bag(reader: &BagReader) -> anyhow::Result<Value> {
    let summary = reader.summary();
    let cadences = reader.cadences()?;
    let topics = summary.topics.iter().map(|counted| {
        let cadence = cadences.get(&counted.topic.name);
        json!({
            "name": counted.topic.name,
            "type": counted.topic.type_name,
            "messages": counted.message_count,
            "rate_hz": cadence.map(|own| own.rate_hz),
            "span_s": cadence.map(|own| own.span_s),
            "jitter_s": cadence.map(|own| own.jitter_s),
            "gaps": cadence.map(|own| own.gaps),
            "longest_gap_s": cadence.map(|own| own.longest_gap_s),
        })
    });
    let references = cromosim_recording::pose_topics(reader)?;
    let references = references.into_iter();
    let references = references.map(|own| json!({"topic": own.topic, "bodies": own.bodies}));
    let attachments = reader
        .attachments()
        .map(|attachment| json!({"name": attachment.name, "bytes": attachment.content.len()}));
    // rosbag2's own says what the rest says.
    let metadata = reader
        .metadata_records()
        .filter(|(name, _)| *name != "rosbag2")
        .map(|(name, values)| (name.to_owned(), json!(values)));
    Ok(json!({
        "messages": summary.message_count(),
        "duration_s": summary.duration(),
        "start_s": summary.time_range.map(|(start, _)| start.as_seconds()),
        "topics": topics.collect::<Vec<_>>(),
        "references": references.collect::<Vec<_>>(),
        "attachments": attachments.collect::<Vec<_>>(),
        "metadata": metadata.collect::<Map<_, _>>(),
    }))
}

fn dataset(format: DatasetFormat, recording: &DatasetRecording) -> Value {
    let imus = recording.imus.iter().map(|imu| {
        let stamps = &imu.series.stamps;
        let ends = stamps.first().zip(stamps.last());
        let reference = recording.reference(&imu.placement);
        json!({
            "placement": imu.placement,
            "readings": stamps.len(),
            "duration_s": ends.map_or(0.0, |(first, last)| *last - *first),
            "reference_poses": reference.map(|poses| poses.stamps.len()),
            "rows_left_out": imu.rows_left_out,
        })
    });
    let alone = recording.placements().split_off(recording.imus.len());
    let alone = alone.into_iter();
    let alone = alone.filter_map(|name| Some((name, recording.reference(name)?)));
    let references = alone.map(|(name, poses)| {
        let ends = poses.stamps.first().zip(poses.stamps.last());
        json!({
            "name": name,
            "poses": poses.stamps.len(),
            "duration_s": ends.map_or(0.0, |(first, last)| *last - *first),
            "path_m": path_length(&poses.positions),
        })
    });
    let activities = recording
        .activities
        .iter()
        .map(|span| json!({"activity": span.activity, "start_s": span.start.as_seconds(), "end_s": span.end.as_seconds()}));
    json!({
        "format": format.to_string(),
        "rate_hz": recording.rate_hz,
        "imus": imus.collect::<Vec<_>>(),
        "references": references.collect::<Vec<_>>(),
        "notes": recording.notes,
        "activities": activities.collect::<Vec<_>>(),
    })
}

/// A format in words.
pub fn rigid_kind(format: RigidFormat) -> &'static str {
    match format {
        RigidFormat::Tum => "trajectory (TUM)",
        RigidFormat::EurocGroundTruth => "trajectory (EuRoC ground truth)",
        RigidFormat::PoseCsv => "trajectory (table with a header)",
        RigidFormat::EurocImu => "IMU series (EuRoC)",
        RigidFormat::ImuCsv => "IMU series (table with a header)",
    }
}

fn rigid(found: &RigidInspection) -> Value {
    let mut value = json!({
        "format": rigid_kind(found.format),
        "rows": found.rows,
        "rate_hz": found.median_rate_hz,
        "start_s": found.first.as_seconds(),
        "duration_s": found.duration_s,
    });
    match found.extent {
        RigidExtent::Path(length) => value["path_m"] = json!(length),
        RigidExtent::Means {
            specific_force,
            angular_velocity,
        } => {
            value["mean_specific_force_m_s2"] = json!(specific_force);
            value["mean_angular_velocity_rad_s"] = json!(angular_velocity);
        }
    }
    value
}

fn body(found: &BodyInspection) -> Value {
    json!({
        "id": found.id,
        "vertices": found.vertices,
        "triangles": found.triangles,
        "joints": Joint::ALL.len(),
        "betas": found.betas,
        "gender": found.gender.map(|gender| gender.name()),
        "height_m": found.height_m,
    })
}

fn poses(found: &PosesInspection) -> Value {
    let (played, not_played) = match &found.motion {
        Ok(played) => (Some(motion(played)), None),
        Err(error) => (None, Some(error.to_string())),
    };
    json!({
        "format": found.format.to_string(),
        "people": found.people.iter().map(person).collect::<Vec<_>>(),
        "played": played,
        "not_played": not_played,
    })
}

fn person(found: &PersonInspection) -> Value {
    let ids = found.frame_ids.as_ref();
    json!({
        "person": found.person,
        "frames": found.frames,
        "first_frame_id": ids.map(|ids| ids.start()),
        "last_frame_id": ids.map(|ids| ids.end()),
        "rate_hz": found.rate_hz,
        "gender": found.gender.map(|gender| gender.name()),
        "axes": match found.axes {
            PoseAxes::Camera => "camera",
            PoseAxes::Up(_) => "world",
            PoseAxes::Detect => "not stated",
        },
        "up": match found.axes {
            PoseAxes::Up(up) => json!([up.x, up.y, up.z]),
            _ => Value::Null,
        },
        "has_trajectory": found.has_trajectory,
        "betas": found.betas,
        "shape_space": found.shape_space.to_string(),
    })
}

fn motion(found: &SmplMotion) -> Value {
    let positions: Vec<_> = found
        .frames
        .iter()
        .map(|frame| frame.root_position)
        .collect();
    let heights = || positions.iter().map(|position| position.z);
    let betas = found.report.as_ref().map(|report| &report.betas);
    let betas = betas.or(found.markers.as_ref().map(|report| &report.betas));
    json!({
        "frames": found.frames.len(),
        "rate_hz": found.rate_hz,
        "duration_s": found.duration_s(),
        "betas": betas,
        "bone_length_rms_m": found.report.as_ref().map(|report| report.bone_length_rms_m),
        "markers_absent": found.markers.as_ref().map(|report| &report.absent),
        "markers_unknown": found.markers.as_ref().map(|report| &report.unknown),
        "pelvis_path_m": path_length(&positions),
        "pelvis_lowest_m": heights().reduce(f64::min),
        "pelvis_highest_m": heights().reduce(f64::max),
        "unlikely": found.oddities().iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}
