//! A topic of a bag as a motion, a trajectory or an IMU series.

use std::path::Path;

use cromosim_bag::BagReader;
use cromosim_msgs::RosMessage;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use super::{Content, Read, ReadOptions, Target, dataset, motion_topic};
use crate::datasets::{DatasetFormat, DatasetRecording, PlacedImu};
use crate::frame_tree::FrameTree;
use crate::pose_source::stamped_poses;
use crate::rigid::{EurocGroundTruth, ImuSeries, PoseTrajectory};
use crate::{POSE_TYPES, PoseSource, RecordingError, read_poses, read_static};

/// Reads the chosen topic, or the chosen frame of the bag's TF.
pub(super) fn read(
    path: &Path,
    options: &ReadOptions,
    target: Target,
) -> Result<Read, RecordingError> {
    if target == Target::Columns && options.bag_setting().is_none() {
        return every_imu(path, options);
    }
    let reader = BagReader::open(path)?;
    if let Some(frame) = &options.frame {
        let tree = FrameTree::read(&reader)?;
        let trajectory = tree.trajectory(frame, options.fixed_frame.as_deref())?;
        return Ok(poses(trajectory).into());
    }
    let (source, type_name) = choose(&reader, options, target)?;
    let topic = &source.topic;
    let unsuitable = |problem: String| RecordingError::Unsuitable {
        path: format!("{}, {topic}", path.display()).into(),
        problem,
    };
    match type_name.as_str() {
        name if name == Imu::TYPE_NAME => series(&reader, topic),
        name if motion_topic::types().contains(&name) => {
            let setting = options.motion_setting(false);
            if let Some(option) = setting.filter(|option| *option != "--person") {
                return Err(unsuitable(format!(
                    "{option} is for motion files, and these are poses in SMPL's joints already; leave it out"
                )));
            }
            let (motion, notes) = motion_topic::read(&reader, topic, options)?;
            let motion = motion.slice(options.motion.start_s, options.motion.duration_s)?;
            let content = Content::Motion(Box::new(motion));
            Ok(Read { content, notes })
        }
        name if name == TFMessage::TYPE_NAME && source.body.is_none() => {
            Err(RecordingError::Unsuitable {
                path: topic.clone().into(),
                problem: format!(
                    "a tree of frames; give --frame, one of {}",
                    FrameTree::read(&reader)?.known()
                ),
            })
        }
        name if POSE_TYPES.contains(&name) => trajectory(&reader, &source),
        other => Err(unsuitable(format!(
            "a topic of {other}; {}, {}, {}, {} (TF with --frame) are converted",
            motion_topic::types()[0],
            motion_topic::types()[1],
            Imu::TYPE_NAME,
            POSE_TYPES.join(", ")
        ))),
    }
}

/// All IMUs of a bag, which columns hold side by side.
fn every_imu(path: &Path, options: &ReadOptions) -> Result<Read, RecordingError> {
    let read = read_static(path)?;
    let imus = read.into_iter().map(|own| {
        let both = own.readings.iter();
        let series = ImuSeries {
            stamps: own.stamps,
            specific_force: both.clone().map(|it| it.specific_force).collect(),
            angular_velocity: both.map(|it| it.angular_velocity).collect(),
        };
        PlacedImu {
            placement: own.name,
            series,
            ..PlacedImu::default()
        }
    });
    let recording = DatasetRecording {
        name: path.display().to_string(),
        imus: imus.collect(),
        ..DatasetRecording::default()
    };
    let recording = (DatasetFormat::Columns, recording);
    dataset::chosen(path, recording, Target::Columns, options)
}

/// The given topic, or the only one that suits; with its type.
fn choose(
    reader: &BagReader,
    options: &ReadOptions,
    target: Target,
) -> Result<(PoseSource, String), RecordingError> {
    if let Some(topic) = &options.topic {
        let source = PoseSource::parse(topic);
        let type_name = reader.topic(&source.topic)?.type_name.clone();
        return Ok((source, type_name));
    }
    let wants_motion =
        (target.takes_motions() && target != Target::Bag) || options.followed.is_some();
    let of_types = |types: &[&str]| {
        let topics = reader.summary().topics.iter().map(|counted| &counted.topic);
        let suits = topics.filter(|topic| types.contains(&topic.type_name.as_str()));
        suits
            .map(|topic| (topic.name.clone(), topic.type_name.clone()))
            .collect::<Vec<_>>()
    };
    let found = if wants_motion {
        // The state is what became of the pose.
        let [states, poses] = motion_topic::types().map(|name| of_types(&[name]));
        if states.is_empty() { poses } else { states }
    } else {
        let readings = takes_readings(target).then_some(Imu::TYPE_NAME);
        let plain: Vec<&str> = [PoseStamped::TYPE_NAME]
            .into_iter()
            .chain(readings)
            .collect();
        let found = of_types(&plain);
        // Else odometry and the like.
        let others = POSE_TYPES.into_iter().filter(is_without_frames);
        if found.is_empty() {
            of_types(&others.collect::<Vec<_>>())
        } else {
            found
        }
    };
    if let [(topic, type_name)] = found.as_slice() {
        return Ok((PoseSource::topic(topic), type_name.clone()));
    }
    Err(RecordingError::Unsuitable {
        path: reader.path().to_owned(),
        problem: none_or_several(&found, wants_motion, target),
    })
}

/// Why nothing was chosen of topics with their types.
fn none_or_several(found: &[(String, String)], wants_motion: bool, target: Target) -> String {
    let several: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    if !several.is_empty() {
        return format!(
            "several topics; give --topic, one of {}",
            several.join(", ")
        );
    }
    if wants_motion {
        let [state, pose] = motion_topic::types();
        return format!("no topic of {state} or {pose}");
    }
    let readings = takes_readings(target).then_some(Imu::TYPE_NAME);
    let poses = POSE_TYPES.into_iter().filter(is_without_frames);
    let types: Vec<&str> = readings.into_iter().chain(poses).collect();
    format!(
        "no topic of {}; --frame takes a frame of TF",
        types.join(" or ")
    )
}

/// A TUM file holds no readings.
fn takes_readings(target: Target) -> bool {
    target != Target::Tum
}

/// TF has no pose without a frame.
fn is_without_frames(type_name: &&str) -> bool {
    *type_name != TFMessage::TYPE_NAME
}

fn poses(trajectory: PoseTrajectory) -> Content {
    Content::Poses(EurocGroundTruth {
        trajectory,
        ..EurocGroundTruth::default()
    })
}

fn trajectory(reader: &BagReader, source: &PoseSource) -> Result<Read, RecordingError> {
    let mut notes = Vec::new();
    let frames = read_poses(reader, source, &mut notes)?;
    let first = stamped_poses(reader, source)?.into_iter().next();
    let mut trajectory = PoseTrajectory {
        frame: first
            .map(|message| message.header.frame_id)
            .unwrap_or_default(),
        ..PoseTrajectory::default()
    };
    for frame in &frames {
        let pose = &frame.world_from_sensor;
        trajectory.push(frame.stamp, pose.translation.vector, pose.rotation);
    }
    Ok(Read {
        content: poses(trajectory),
        notes: notes
            .iter()
            .map(|note| format!("{source}: {note}"))
            .collect(),
    })
}

/// Readings in order of time; what is not finite or repeats a stamp is left out, with a note.
fn series(reader: &BagReader, topic: &str) -> Result<Read, RecordingError> {
    let messages = reader.read::<Imu>(topic)?;
    let count = messages.len();
    let mut rows: Vec<(Stamp, Vector3<f64>, Vector3<f64>)> = messages
        .into_iter()
        .map(|(_, imu)| {
            (
                Stamp::from_nanos(imu.header.stamp.nanos()),
                imu.linear_acceleration.into(),
                imu.angular_velocity.into(),
            )
        })
        .filter(
            |(_, specific_force, angular_velocity): &(_, Vector3<f64>, Vector3<f64>)| {
                let mut values = specific_force.iter().chain(angular_velocity.iter());
                values.all(|value| value.is_finite())
            },
        )
        .collect();
    rows.sort_by_key(|(stamp, ..)| *stamp);
    rows.dedup_by_key(|(stamp, ..)| *stamp);
    if rows.is_empty() {
        return Err(RecordingError::NoFiniteReading {
            path: reader.path().to_owned(),
            topic: topic.to_owned(),
            count,
        });
    }
    let mut notes = Vec::new();
    if rows.len() < count {
        notes.push(format!(
            "{topic}: {} of {count} messages repeat a stamp or are not finite, and are left out",
            count - rows.len()
        ));
    }
    let mut series = ImuSeries::default();
    for (stamp, specific_force, angular_velocity) in rows {
        series.push(stamp, specific_force, angular_velocity);
    }
    Ok(Read {
        content: Content::Imu(series),
        notes,
    })
}
