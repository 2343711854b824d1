//! A topic of a bag as a motion, a trajectory or an IMU series.

use std::path::Path;

use cromosim_bag::BagReader;
use cromosim_msgs::RosMessage;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use super::frame_tree::FrameTree;
use super::{Content, Read, ReadOptions, Target, dataset, motion_topic};
use crate::datasets::{DatasetRecording, PlacedImu};
use crate::rigid::{EurocGroundTruth, ImuSeries, PoseTrajectory};
use crate::{RecordingError, read_poses, read_static};

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
    let (topic, type_name) = choose(&reader, options, target)?;
    let unsuitable = |problem: String| RecordingError::Unsuitable {
        path: format!("{}, {topic}", path.display()).into(),
        problem,
    };
    match type_name.as_str() {
        name if name == PoseStamped::TYPE_NAME => trajectory(&reader, &topic),
        name if name == Imu::TYPE_NAME => series(&reader, &topic),
        name if motion_topic::types().contains(&name) => {
            let setting = options.motion_setting(false);
            if let Some(option) = setting.filter(|option| *option != "--person") {
                return Err(unsuitable(format!(
                    "{option} is for motion files, and these are poses in SMPL's joints already; leave it out"
                )));
            }
            let (motion, notes) = motion_topic::read(&reader, &topic, options)?;
            let motion = motion.slice(options.motion.start_s, options.motion.duration_s)?;
            let content = Content::Motion(Box::new(motion));
            Ok(Read { content, notes })
        }
        name if name == TFMessage::TYPE_NAME => Err(RecordingError::Unsuitable {
            path: topic.clone().into(),
            problem: format!(
                "a tree of frames; give --frame, one of {}",
                FrameTree::read(&reader)?.known()
            ),
        }),
        other => Err(unsuitable(format!(
            "a topic of {other}; {}, {}, {}, {} and {} (with --frame) are converted",
            motion_topic::types()[0],
            motion_topic::types()[1],
            PoseStamped::TYPE_NAME,
            Imu::TYPE_NAME,
            TFMessage::TYPE_NAME
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
    dataset::chosen(path, recording, Target::Columns, options)
}

/// The given topic, or the only one that suits; with its type.
fn choose(
    reader: &BagReader,
    options: &ReadOptions,
    target: Target,
) -> Result<(String, String), RecordingError> {
    if let Some(topic) = &options.topic {
        return Ok((topic.clone(), reader.topic(topic)?.type_name.clone()));
    }
    // A TUM file holds no readings.
    let takes_readings = target != Target::Tum;
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
    } else if takes_readings {
        of_types(&[PoseStamped::TYPE_NAME, Imu::TYPE_NAME])
    } else {
        of_types(&[PoseStamped::TYPE_NAME])
    };
    let problem = match found.as_slice() {
        [only] => return Ok(only.clone()),
        [] if wants_motion => {
            let [state, pose] = motion_topic::types();
            format!("no topic of {state} or {pose}")
        }
        [] => format!(
            "no topic of {} or {}; --frame takes a frame of TF",
            PoseStamped::TYPE_NAME,
            Imu::TYPE_NAME
        ),
        several => {
            let names: Vec<&str> = several.iter().map(|(name, _)| name.as_str()).collect();
            format!("several topics; give --topic, one of {}", names.join(", "))
        }
    };
    Err(RecordingError::Unsuitable {
        path: reader.path().to_owned(),
        problem,
    })
}

fn poses(trajectory: PoseTrajectory) -> Content {
    Content::Poses(EurocGroundTruth {
        trajectory,
        ..EurocGroundTruth::default()
    })
}

fn trajectory(reader: &BagReader, topic: &str) -> Result<Read, RecordingError> {
    let mut notes = Vec::new();
    let frames = read_poses(reader, topic, &mut notes)?;
    let first = reader.read::<PoseStamped>(topic)?.into_iter().next();
    let mut trajectory = PoseTrajectory {
        frame: first
            .map(|(_, message)| message.header.frame_id)
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
            .map(|note| format!("{topic}: {note}"))
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
