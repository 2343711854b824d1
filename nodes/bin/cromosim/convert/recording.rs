//! A topic of a bag as a trajectory or an IMU series.

use std::path::Path;
use std::sync::Arc;

use anyhow::{anyhow, bail};
use cromosim_bag::BagReader;
use cromosim_body::BodyModel;
use cromosim_msgs::RosMessage;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_recording::read_poses;
use cromosim_recording::rigid::{EurocGroundTruth, ImuSeries, PoseTrajectory};
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use super::frames::Tree;
use super::write::Target;
use super::{Arguments, Content, states};

/// Reads the chosen topic.
pub fn read(
    path: &Path,
    arguments: &Arguments,
    model: &Arc<BodyModel>,
    target: Target,
) -> anyhow::Result<Content> {
    let reader = BagReader::open(path)?;
    let poses = |trajectory| {
        Content::Poses(EurocGroundTruth {
            trajectory,
            ..EurocGroundTruth::default()
        })
    };
    if let Some(frame) = &arguments.frame {
        return tree_trajectory(&reader, frame, arguments).map(poses);
    }
    let (topic, type_name) = choose(&reader, arguments, target)?;
    match type_name.as_str() {
        name if name == PoseStamped::TYPE_NAME => trajectory(&reader, &topic).map(poses),
        name if name == Imu::TYPE_NAME => series(&reader, &topic).map(Content::Imu),
        name if states::types().contains(&name) => {
            if let Some(option) = arguments
                .motion
                .given(false)
                .filter(|option| *option != "--person")
            {
                bail!(
                    "{}, {topic}: {option} is for motion files, and these are poses in SMPL's joints already; leave it out",
                    path.display()
                );
            }
            let options = arguments.motion.options()?;
            let given = arguments.body.as_ref().map(|_| model);
            let motion = states::motion(&reader, &topic, options.person.as_deref(), given)?;
            Ok(Content::Motion(Box::new(
                motion.slice(options.start_s, options.duration_s)?,
            )))
        }
        name if name == TFMessage::TYPE_NAME => bail!(
            "{topic}: a tree of frames; give --frame, one of {}",
            Tree::read(&reader)?.known()
        ),
        other => bail!(
            "{}, {topic}: a topic of {other}; {}, {}, {}, {} and {} (with --frame) are converted",
            path.display(),
            states::types()[0],
            states::types()[1],
            PoseStamped::TYPE_NAME,
            Imu::TYPE_NAME,
            TFMessage::TYPE_NAME
        ),
    }
}

/// The given topic, or the only one that suits.
fn choose(
    reader: &BagReader,
    arguments: &Arguments,
    target: Target,
) -> anyhow::Result<(String, String)> {
    if let Some(topic) = &arguments.topic {
        return Ok((topic.clone(), reader.topic(topic)?.type_name.clone()));
    }
    // A TUM file holds no readings.
    let takes_readings = target != Target::Tum;
    let wants_motion = (target.takes_motions() && target != Target::Bag)
        || arguments.joint.is_some()
        || arguments.site.is_some();
    let of_types = |types: &[&str]| {
        let topics = reader.summary().topics.iter().map(|counted| &counted.topic);
        let suits = topics.filter(|topic| types.contains(&topic.type_name.as_str()));
        suits
            .map(|topic| (topic.name.clone(), topic.type_name.clone()))
            .collect::<Vec<_>>()
    };
    let found = if wants_motion {
        // The state is what became of the pose.
        let [states, poses] = states::types().map(|name| of_types(&[name]));
        if states.is_empty() { poses } else { states }
    } else if takes_readings {
        of_types(&[PoseStamped::TYPE_NAME, Imu::TYPE_NAME])
    } else {
        of_types(&[PoseStamped::TYPE_NAME])
    };
    match found.as_slice() {
        [only] => Ok(only.clone()),
        [] if wants_motion => bail!(
            "{}: no topic of {} or {}",
            reader.path().display(),
            states::types()[0],
            states::types()[1]
        ),
        [] => {
            bail!(
                "{}: no topic of {} or {}; --frame takes a frame of TF",
                reader.path().display(),
                PoseStamped::TYPE_NAME,
                Imu::TYPE_NAME
            )
        }
        several => {
            let names: Vec<&str> = several.iter().map(|(name, _)| name.as_str()).collect();
            bail!(
                "{}: several topics; give --topic, one of {}",
                reader.path().display(),
                names.join(", ")
            )
        }
    }
}

fn trajectory(reader: &BagReader, topic: &str) -> anyhow::Result<PoseTrajectory> {
    let mut notes = Vec::new();
    let frames = read_poses(reader, topic, &mut notes)?;
    notes.iter().for_each(|note| eprintln!("{topic}: {note}"));
    let first = reader.read::<PoseStamped>(topic)?.into_iter().next();
    Ok(PoseTrajectory {
        stamps: frames.iter().map(|frame| frame.stamp).collect(),
        positions: frames
            .iter()
            .map(|frame| frame.world_from_sensor.translation.vector)
            .collect(),
        rotations: frames
            .iter()
            .map(|frame| frame.world_from_sensor.rotation)
            .collect(),
        frame: first
            .map(|(_, message)| message.header.frame_id)
            .unwrap_or_default(),
    })
}

fn tree_trajectory(
    reader: &BagReader,
    frame: &str,
    arguments: &Arguments,
) -> anyhow::Result<PoseTrajectory> {
    let tree = Tree::read(reader)?;
    tree.trajectory(frame, arguments.fixed_frame.as_deref())
        .map_err(|error| anyhow!("{}: {error}", reader.path().display()))
}

/// Readings in order of time; what is not finite or repeats a stamp is left out, and said.
fn series(reader: &BagReader, topic: &str) -> anyhow::Result<ImuSeries> {
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
        .filter(|(_, force, rate): &(_, Vector3<f64>, Vector3<f64>)| {
            force
                .iter()
                .chain(rate.iter())
                .all(|value| value.is_finite())
        })
        .collect();
    rows.sort_by_key(|(stamp, ..)| *stamp);
    rows.dedup_by_key(|(stamp, ..)| *stamp);
    if rows.is_empty() {
        bail!(
            "{}, {topic}: no finite reading ({count} messages)",
            reader.path().display()
        );
    }
    if rows.len() < count {
        eprintln!(
            "{topic}: {} of {count} messages repeat a stamp or are not finite, and are left out",
            count - rows.len()
        );
    }
    Ok(ImuSeries {
        stamps: rows.iter().map(|row| row.0).collect(),
        specific_force: rows.iter().map(|row| row.1).collect(),
        angular_velocity: rows.iter().map(|row| row.2).collect(),
    })
}
