//! What a recording holds of its placements: reference poses and the messages of the real IMUs.

use std::sync::Arc;

use anyhow::{Context, anyhow, bail};
use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_gap::{ImuSeries, PlacementRecord, PoseSeries};
use cromosim_imu::{MountedSensors, PlacementSet, Reading, SensorFrame, SensorTrajectory};
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_spatial::Stamp;

use crate::body;

/// A placement of a recording: its reference, and its real IMU where there is one.
pub struct Recorded {
    /// Name.
    pub name: String,
    /// The reference: finite, in the order of time, no stamp twice, at least one.
    pub frames: Vec<SensorFrame>,
    /// Messages of `/imu/NAME/data_raw`.
    pub measured: Vec<Imu>,
    /// What a user should know of what was left out.
    pub notes: Vec<String>,
}

/// The placements with a reference, each on its own: what is wrong with one does not hide the
/// others. `body` is for a recording of SMPL states.
pub fn read(
    reader: &BagReader,
    body: Option<&Arc<BodyModel>>,
) -> anyhow::Result<Vec<(String, anyhow::Result<Recorded>)>> {
    let references = names(reader, "/reference/", "", PoseStamped::TYPE_NAME);
    if references.is_empty() {
        let trajectories = from_states(reader, body)?.into_iter();
        return Ok(trajectories
            .map(|(name, frames)| (name.clone(), with_imu(reader, name, frames, Vec::new())))
            .collect());
    }
    let read = |name: String| {
        let mut notes = Vec::new();
        let recorded = from_reference(reader, &name, &mut notes)
            .and_then(|frames| with_imu(reader, name.clone(), frames, notes));
        (name, recorded)
    };
    Ok(references.into_iter().map(read).collect())
}

/// The parts of topic names of a type between `prefix` and `suffix`, in order.
fn names(reader: &BagReader, prefix: &str, suffix: &str, type_name: &str) -> Vec<String> {
    let topics = reader
        .summary()
        .topics
        .iter()
        .filter(|counted| counted.topic.type_name == type_name);
    let mut names: Vec<String> = topics
        .filter_map(|counted| {
            Some(
                counted
                    .topic
                    .name
                    .strip_prefix(prefix)?
                    .strip_suffix(suffix)?
                    .to_owned(),
            )
        })
        .collect();
    names.sort();
    names
}

fn with_imu(
    reader: &BagReader,
    name: String,
    frames: Vec<SensorFrame>,
    notes: Vec<String>,
) -> anyhow::Result<Recorded> {
    let has_imu = names(reader, "/imu/", "/data_raw", Imu::TYPE_NAME).contains(&name);
    let measured = if has_imu {
        reader.read::<Imu>(&format!("/imu/{name}/data_raw"))?
    } else {
        Vec::new()
    };
    Ok(Recorded {
        name,
        frames,
        measured: measured.into_iter().map(|(_, message)| message).collect(),
        notes,
    })
}

fn from_reference(
    reader: &BagReader,
    name: &str,
    notes: &mut Vec<String>,
) -> anyhow::Result<Vec<SensorFrame>> {
    poses(reader, &format!("/reference/{name}"), notes)
}

/// The poses of a PoseStamped topic: finite, in the order of time, no stamp twice, at least one.
/// `notes` says what was left out.
pub fn poses(
    reader: &BagReader,
    topic: &str,
    notes: &mut Vec<String>,
) -> anyhow::Result<Vec<SensorFrame>> {
    let file = reader.path().display();
    let messages = reader.read::<PoseStamped>(topic)?;
    let count = messages.len();
    let mut frames = Vec::with_capacity(count);
    for (_, message) in messages {
        let stamp = Stamp::from_nanos(message.header.stamp.nanos());
        let (p, q) = (&message.pose.position, &message.pose.orientation);
        // What motion capture writes while it sees nothing.
        if ![p.x, p.y, p.z, q.x, q.y, q.z, q.w]
            .iter()
            .all(|value| value.is_finite())
        {
            continue;
        }
        let world_from_sensor = message
            .pose
            .try_into()
            .map_err(|error| anyhow!("{file}, {topic} at {:.6} s: {error}", stamp.as_seconds()))?;
        frames.push(SensorFrame::new(stamp, world_from_sensor));
    }
    let finite = frames.len();
    if finite < count {
        notes.push(format!(
            "{} of {count} reference poses are NaN or infinite and left out",
            count - finite
        ));
    }
    if frames.is_empty() {
        bail!("{file}, {topic}: no pose but NaN or infinite ones ({count} messages)");
    }
    frames.sort_by_key(|frame| frame.stamp);
    frames.dedup_by_key(|frame| frame.stamp);
    if frames.len() < finite {
        notes.push(format!(
            "{} reference poses repeat a stamp and are left out",
            finite - frames.len()
        ));
    }
    Ok(frames)
}

/// The sites' poses from the recording's states and its attachment `placements.yaml`.
fn from_states(
    reader: &BagReader,
    body: Option<&Arc<BodyModel>>,
) -> anyhow::Result<Vec<(String, Vec<SensorFrame>)>> {
    let path = reader.path().display();
    let Some(placements) = reader.attachment("placements.yaml") else {
        bail!(
            "{path}: the recording holds neither /reference/NAME (geometry_msgs/msg/PoseStamped) nor an attachment placements.yaml beside SMPL states; there is no reference"
        );
    };
    let placements = PlacementSet::parse(
        &String::from_utf8_lossy(placements),
        &format!("{path}, attachment placements.yaml"),
    )?;
    let mut states = reader.read::<SmplState>("/smpl/state")?;
    states.sort_by_key(|(_, state)| state.header.stamp.nanos());
    states.dedup_by_key(|(_, state)| state.header.stamp.nanos());
    let Some((_, last)) = states.last() else {
        bail!("{path}: /smpl/state holds no message")
    };
    let model = body::of_bag(reader, body)?;
    model
        .check_named_betas(&last.shape_space, &last.gender, &last.betas)
        .with_context(|| format!("{path}, /smpl/state"))?;
    let shaped = ShapedBody::new(model, &last.betas)?;
    let sites = MountedSensors::new(&shaped, placements.placements())?;
    let stamps: Vec<Stamp> = states
        .iter()
        .map(|(_, state)| Stamp::from_nanos(state.header.stamp.nanos()))
        .collect();
    let pose = |state: &SmplState| {
        state
            .root_and_rotations()
            .map(|(root_position, local_rotations)| BodyPose {
                root_position,
                local_rotations,
            })
    };
    let poses = states
        .iter()
        .map(|(_, state)| pose(state))
        .collect::<Result<Vec<_>, _>>()?;
    let frames = sites
        .trajectories(&stamps, &poses)?
        .into_iter()
        .map(|trajectory| trajectory.frames().to_vec());
    Ok(placements
        .placements()
        .iter()
        .map(|placement| placement.name().to_owned())
        .zip(frames)
        .collect())
}

impl Recorded {
    /// The reference as poses.
    pub fn poses(&self) -> PoseSeries {
        PoseSeries {
            stamps: self.frames.iter().map(|frame| frame.stamp).collect(),
            positions: self
                .frames
                .iter()
                .map(|frame| frame.world_from_sensor.translation.vector)
                .collect(),
            rotations: self
                .frames
                .iter()
                .map(|frame| frame.world_from_sensor.rotation)
                .collect(),
        }
    }

    /// The reference as the derivative schemes take it.
    pub fn trajectory(&self) -> anyhow::Result<SensorTrajectory> {
        Ok(SensorTrajectory::new(self.frames.clone())?)
    }

    /// Stamps of the first and the last reference pose.
    pub fn span(&self) -> (Stamp, Stamp) {
        (
            self.frames[0].stamp,
            self.frames[self.frames.len() - 1].stamp,
        )
    }

    /// Standard deviation per sample and axis that the first message declares: accelerometer,
    /// gyroscope; none where it is unknown.
    pub fn declared(&self) -> [Option<f64>; 2] {
        let Some(first) = self.measured.first() else {
            return [None, None];
        };
        [
            first.linear_acceleration_covariance,
            first.angular_velocity_covariance,
        ]
        .map(|covariance| {
            let sigma = ((covariance[0] + covariance[4] + covariance[8]) / 3.0).sqrt();
            // REP-145: a first entry of -1 says that there is no such value; all zero says that it
            // is not known.
            (covariance[0] >= 0.0 && sigma > 0.0 && sigma.is_finite()).then_some(sigma)
        })
    }

    /// What a diagnosis takes.
    pub fn record(&self) -> PlacementRecord {
        let reading = |message: &Imu| Reading {
            specific_force: message.linear_acceleration.into(),
            angular_velocity: message.angular_velocity.into(),
        };
        let stamps = self
            .measured
            .iter()
            .map(|message| Stamp::from_nanos(message.header.stamp.nanos()))
            .collect();
        let imu = ImuSeries {
            stamps,
            readings: self.measured.iter().map(reading).collect(),
            declared: self.declared(),
        };
        PlacementRecord {
            name: self.name.clone(),
            reference: self.poses(),
            imu,
        }
    }
}
