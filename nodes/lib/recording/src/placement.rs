//! The placements of a bag: reference poses, and the messages of the real IMUs.

use std::collections::BTreeMap;
use std::sync::Arc;

use cromosim_bag::BagReader;
use cromosim_body::{BodyModel, BodyPose, ShapedBody};
use cromosim_gap::{ClockJump, MeasuredField, MeasuredImu, PlacementRecord, PoseSeries};
use cromosim_imu::{
    Channel, MountedSensors, PerChannel, PlacementSet, Reading, SensorFrame, SensorTrajectory,
};
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField};
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_spatial::{Stamp, meant};

use crate::pose_source::{frame_trajectory, stamped_poses};
use crate::topics::{PoseSource, TopicMap, check_imu_topic};
use crate::{RecordingError, body_for_bag};

/// Stamps of a reference that go back further were set back, s: messages overtake each other by less.
const SET_BACK_S: f64 = 1.0;
/// Stamps that go on so much later may be those of a clock that was set, s.
const SET_ON_S: f64 = 10.0;
/// Earlier stretches of one clock that are looked at: work stays bounded whatever the stamps are.
const MOST_SPANS: usize = 8;

/// A placement of a recording: its reference, and its real IMU where there is one.
#[derive(Clone, Debug)]
pub struct RecordedPlacement {
    /// The NAME of `/reference/NAME` and `/imu/NAME/data_raw`, or as a [`TopicMap`] says.
    pub name: String,
    /// The reference: finite, in the order of time, no stamp twice, at least one.
    pub frames: Vec<SensorFrame>,
    /// Messages of the IMU's topic as they were recorded; empty where nothing was measured.
    pub measured: Vec<Imu>,
    /// What was left out of the reference, a sentence each.
    pub notes: Vec<String>,
    /// Where the reference's clock was set back over time that it had been through; these poses are
    /// left out.
    pub set_back: Vec<ClockJump>,
    /// Messages of `/imu/NAME/mag` as they were recorded; empty without any.
    pub magnetic: Vec<MagneticField>,
}

/// The placements of a bag that have a reference, by name, each on its own: what is wrong with one
/// does not hide the others.
///
/// References are the topics `/reference/NAME` (PoseStamped). A bag without any holds SMPL states
/// on `/smpl/state` and an attachment `placements.yaml`: then the sites' poses on the body are the
/// references, and `body` is the body where it is not the embedded one.
///
/// ```no_run
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let bag = cromosim_bag::BagReader::open("recording.mcap".as_ref())?;
/// for (name, placement) in cromosim_recording::read_placements(&bag, None)? {
///     let record = placement?.record();
///     println!("{name}: {} readings", record.imu.readings.len());
/// }
/// # Ok(()) }
/// ```
///
/// # Errors
/// [`RecordingError::NoReference`], and what is wrong with states, body or placements; within the
/// list what is wrong with that placement's topics.
#[allow(clippy::type_complexity)]
pub fn read_placements(
    reader: &BagReader,
    body: Option<&Arc<BodyModel>>,
) -> Result<Vec<(String, Result<RecordedPlacement, RecordingError>)>, RecordingError> {
    read_mapped_placements(reader, body, &TopicMap::default())
}

/// As [`read_placements`], with the topics that `topics` names: references that it names are all that
/// there are, and IMUs that it does not name are on `/imu/NAME/data_raw`.
///
/// # Errors
/// As [`read_placements`]; a topic that is not there or of a wrong type, and an IMU whose placement
/// has no reference.
#[allow(clippy::type_complexity)]
pub fn read_mapped_placements(
    reader: &BagReader,
    body: Option<&Arc<BodyModel>>,
    topics: &TopicMap,
) -> Result<Vec<(String, Result<RecordedPlacement, RecordingError>)>, RecordingError> {
    for topic in topics.imus.values() {
        check_imu_topic(reader, topic)?;
    }
    let references = references(reader, topics);
    let with_imu = |name: String, frames, notes| with_imu(reader, topics, name, frames, notes);
    if references.is_empty() {
        let trajectories = poses_from_states(reader, body)?;
        check_named(reader, topics, trajectories.iter().map(|(name, _)| name))?;
        let trajectories = trajectories.into_iter();
        return Ok(trajectories
            .map(|(name, frames)| (name.clone(), with_imu(name, frames, Vec::new())))
            .collect());
    }
    check_named(reader, topics, references.keys())?;
    let read = |(name, source): (String, PoseSource)| {
        let (mut notes, mut set_back) = (Vec::new(), Vec::new());
        let recorded = read_poses_and_jumps(reader, &source, &mut notes, &mut set_back)
            .and_then(|frames| with_imu(name.clone(), frames, notes))
            .map(|placement| RecordedPlacement {
                set_back,
                ..placement
            });
        (name, recorded)
    };
    Ok(references.into_iter().map(read).collect())
}

/// Where the references are, by placement.
fn references(reader: &BagReader, topics: &TopicMap) -> BTreeMap<String, PoseSource> {
    if !topics.references.is_empty() {
        return topics.references.clone();
    }
    let names = names_between(reader, "/reference/", "", PoseStamped::TYPE_NAME);
    let source = |name: String| {
        let source = PoseSource::topic(&format!("/reference/{name}"));
        (name, source)
    };
    names.into_iter().map(source).collect()
}

/// Each IMU that a user named belongs to a reference.
fn check_named<'a>(
    reader: &BagReader,
    topics: &TopicMap,
    known: impl Iterator<Item = &'a String>,
) -> Result<(), RecordingError> {
    let known: Vec<&str> = known.map(String::as_str).collect();
    let stray = topics.imus.iter();
    let stray = stray
        .into_iter()
        .find(|(name, _)| !known.contains(&name.as_str()));
    let Some((name, topic)) = stray else {
        return Ok(());
    };
    Err(RecordingError::Unsuitable {
        path: reader.path().to_owned(),
        problem: format!(
            "--imu-topic {topic} is the placement {name}, which has no reference; say whose it is, NAME={topic}, of {}{}",
            known.join(", "),
            meant(name, known.iter().copied())
        ),
    })
}

/// The parts of topic names of a type between `prefix` and `suffix`, sorted.
pub(crate) fn names_between(
    reader: &BagReader,
    prefix: &str,
    suffix: &str,
    type_name: &str,
) -> Vec<String> {
    let topics = reader.summary().topics.iter();
    let mut names: Vec<String> = topics
        .filter(|counted| counted.topic.type_name == type_name)
        .filter_map(|counted| {
            let name = counted.topic.name.strip_prefix(prefix)?;
            Some(name.strip_suffix(suffix)?.to_owned())
        })
        .collect();
    names.sort();
    names
}

fn with_imu(
    reader: &BagReader,
    topics: &TopicMap,
    name: String,
    frames: Vec<SensorFrame>,
    notes: Vec<String>,
) -> Result<RecordedPlacement, RecordingError> {
    let topic = topics.imu_topic(&name);
    let has_imu = check_imu_topic(reader, &topic).is_ok();
    let measured = if has_imu {
        reader.read::<Imu>(&topic)?
    } else {
        Vec::new()
    };
    let has_field =
        names_between(reader, "/imu/", "/mag", MagneticField::TYPE_NAME).contains(&name);
    let magnetic = if has_field {
        reader.read::<MagneticField>(&format!("/imu/{name}/mag"))?
    } else {
        Vec::new()
    };
    Ok(RecordedPlacement {
        magnetic: magnetic.into_iter().map(|(_, message)| message).collect(),
        name,
        frames,
        measured: measured.into_iter().map(|(_, message)| message).collect(),
        notes,
        set_back: Vec::new(),
    })
}

/// The poses of a source: finite, in the order of time, no stamp twice, at least one.
/// What was left out is added to `notes`.
///
/// # Errors
/// [`RecordingError::Pose`], [`RecordingError::NoFinitePose`], and what is wrong with the bag.
pub fn read_poses(
    reader: &BagReader,
    source: &PoseSource,
    notes: &mut Vec<String>,
) -> Result<Vec<SensorFrame>, RecordingError> {
    read_poses_and_jumps(reader, source, notes, &mut Vec::new())
}

fn read_poses_and_jumps(
    reader: &BagReader,
    source: &PoseSource,
    notes: &mut Vec<String>,
    set_back: &mut Vec<ClockJump>,
) -> Result<Vec<SensorFrame>, RecordingError> {
    let topic = &source.to_string();
    let (count, mut frames) = frames_of(reader, source)?;
    let finite = frames.len();
    *set_back = leave_out_set_back(&mut frames);
    if finite < count {
        notes.push(format!(
            "{} of {count} reference poses are NaN or infinite and left out",
            count - finite
        ));
    }
    if frames.is_empty() {
        return Err(RecordingError::NoFinitePose {
            path: reader.path().to_owned(),
            topic: topic.to_owned(),
            count,
        });
    }
    let sound = frames.len();
    if sound < finite {
        notes.push(format!(
            "{} reference poses are stamped with time that others before them had been through: the reference's clock was set back; they are left out",
            finite - sound
        ));
    }
    frames.sort_by_key(|frame| frame.stamp);
    frames.dedup_by_key(|frame| frame.stamp);
    if frames.len() < sound {
        notes.push(format!(
            "{} reference poses repeat a stamp and are left out",
            sound - frames.len()
        ));
    }
    Ok(frames)
}

/// How many poses a source has, and those that are finite, in the order of the bag.
fn frames_of(
    reader: &BagReader,
    source: &PoseSource,
) -> Result<(usize, Vec<SensorFrame>), RecordingError> {
    if reader.topic(&source.topic)?.type_name == TFMessage::TYPE_NAME {
        let mut frames = frame_trajectory(reader, source)?.frames();
        let count = frames.len();
        let is_finite = |metres: &f64| metres.is_finite();
        frames.retain(|it| {
            it.world_from_sensor
                .translation
                .vector
                .iter()
                .all(is_finite)
        });
        return Ok((count, frames));
    }
    let topic = source.to_string();
    let messages = stamped_poses(reader, source)?;
    let mut frames = Vec::with_capacity(messages.len());
    for message in &messages {
        frames.extend(frame(message, reader, &topic)?);
    }
    Ok((messages.len(), frames))
}

/// The pose of a message; none where it is no number: what motion capture writes while it sees
/// nothing.
fn frame(
    message: &PoseStamped,
    reader: &BagReader,
    topic: &str,
) -> Result<Option<SensorFrame>, RecordingError> {
    let stamp = Stamp::from_nanos(message.header.stamp.nanos());
    let (p, q) = (&message.pose.position, &message.pose.orientation);
    if ![p.x, p.y, p.z, q.x, q.y, q.z, q.w]
        .iter()
        .all(|value| value.is_finite())
    {
        return Ok(None);
    }
    let pose = message.pose.try_into();
    let world_from_sensor = pose.map_err(|source| RecordingError::Pose {
        path: reader.path().to_owned(),
        topic: topic.to_owned(),
        seconds: stamp.as_seconds(),
        source,
    })?;
    Ok(Some(SensorFrame::new(stamp, world_from_sensor)))
}

/// Takes poses out, in the order in which they came, whose clock was set back over time that it had
/// been through: between the poses of that time they would be another motion.
fn leave_out_set_back(frames: &mut Vec<SensorFrame>) -> Vec<ClockJump> {
    let mut spans: Vec<[Stamp; 2]> = Vec::new();
    let mut jumps: Vec<ClockJump> = Vec::new();
    let (mut jump_s, mut period_s) = ((Stamp::default(), 0.0), 0.0);
    frames.retain(|frame| {
        let stamp = frame.stamp;
        match spans.last_mut() {
            Some(span) if (-SET_BACK_S..=SET_ON_S).contains(&(stamp - span[1])) => {
                if stamp > span[1] {
                    period_s = stamp - span[1];
                    span[1] = stamp;
                }
            }
            last => {
                let by_s = |span: &[Stamp; 2]| stamp - span[1].plus_seconds(period_s);
                jump_s = last.map_or(jump_s, |span| (span[1], by_s(span)));
                spans.push([stamp; 2]);
            }
        }
        let before = spans.iter().rev().skip(1).take(MOST_SPANS);
        let was_through = |span: &[Stamp; 2]| (span[0]..=span[1]).contains(&stamp);
        if !before.into_iter().any(was_through) {
            return true;
        }
        let (at, by) = (jump_s.0.as_seconds(), jump_s.1);
        match jumps.last_mut() {
            Some(jump) if jump.at == at && jump.by == by => jump.messages += 1,
            _ => jumps.push(ClockJump {
                clock: "reference".to_owned(),
                at,
                by,
                messages: 1,
                diagnosed: false,
                recording: String::new(),
            }),
        }
        false
    });
    jumps
}

/// The sites' poses from the bag's states and its attachment `placements.yaml`.
fn poses_from_states(
    reader: &BagReader,
    body: Option<&Arc<BodyModel>>,
) -> Result<Vec<(String, Vec<SensorFrame>)>, RecordingError> {
    let path = reader.path().display();
    let Some(placements) = reader.attachment("placements.yaml") else {
        return Err(RecordingError::NoReference {
            path: reader.path().to_owned(),
        });
    };
    let placements = PlacementSet::parse(
        &String::from_utf8_lossy(placements),
        &format!("{path}, attachment placements.yaml"),
    )?;
    let mut states = reader.read::<SmplState>("/smpl/state")?;
    states.sort_by_key(|(_, state)| state.header.stamp.nanos());
    states.dedup_by_key(|(_, state)| state.header.stamp.nanos());
    let Some((_, last)) = states.last() else {
        return Err(RecordingError::NoMessage {
            path: reader.path().to_owned(),
            topic: "/smpl/state".to_owned(),
        });
    };
    let model = body_for_bag(reader, body)?;
    model
        .check_named_betas(&last.shape_space, &last.gender, &last.betas)
        .map_err(|error| RecordingError::from(error).at(format!("{path}, /smpl/state")))?;
    let shaped = ShapedBody::new(model, &last.betas)?;
    let sites = MountedSensors::new(&shaped, placements.placements())?;
    let states = states.iter().map(|(_, state)| state);
    let stamps: Vec<Stamp> = states
        .clone()
        .map(|state| Stamp::from_nanos(state.header.stamp.nanos()))
        .collect();
    let poses = states.map(body_pose).collect::<Result<Vec<_>, _>>()?;
    let trajectories = sites.trajectories(&stamps, &poses)?.into_iter();
    let frames = trajectories.map(|trajectory| trajectory.frames().to_vec());
    let names = placements.placements().iter();
    Ok(names
        .map(|placement| placement.name().to_owned())
        .zip(frames)
        .collect())
}

/// The pose that a state carries.
pub(crate) fn body_pose(state: &SmplState) -> Result<BodyPose, RecordingError> {
    let (root_position, local_rotations) = state.root_and_rotations()?;
    Ok(BodyPose {
        root_position,
        local_rotations,
    })
}

impl RecordedPlacement {
    /// The reference as poses.
    pub fn poses(&self) -> PoseSeries {
        let world_from_sensor = self.frames.iter().map(|frame| &frame.world_from_sensor);
        PoseSeries {
            stamps: self.frames.iter().map(|frame| frame.stamp).collect(),
            positions: world_from_sensor
                .clone()
                .map(|pose| pose.translation.vector)
                .collect(),
            rotations: world_from_sensor.map(|pose| pose.rotation).collect(),
        }
    }

    /// The reference as the derivative schemes take it.
    ///
    /// # Errors
    /// Where it is shorter than two poses.
    pub fn trajectory(&self) -> Result<SensorTrajectory, RecordingError> {
        Ok(SensorTrajectory::new(self.frames.clone())?)
    }

    /// Stamps of the first and the last reference pose.
    pub fn span(&self) -> (Stamp, Stamp) {
        (
            self.frames[0].stamp,
            self.frames[self.frames.len() - 1].stamp,
        )
    }

    /// Standard deviation per sample and axis that the first message declares, m/s2 and rad/s; none
    /// where it is unknown.
    pub fn declared(&self) -> PerChannel<Option<f64>> {
        let Some(first) = self.measured.first() else {
            return PerChannel::default();
        };
        PerChannel::from_fn(|channel| {
            let covariance = match channel {
                Channel::Accelerometer => first.linear_acceleration_covariance,
                Channel::Gyroscope => first.angular_velocity_covariance,
            };
            let sigma = ((covariance[0] + covariance[4] + covariance[8]) / 3.0).sqrt();
            // REP-145: a first entry of -1 says that there is no such value; all zero says that it
            // is not known.
            (covariance[0] >= 0.0 && sigma > 0.0 && sigma.is_finite()).then_some(sigma)
        })
    }

    /// Stamps of the measured messages.
    pub fn measured_stamps(&self) -> impl Iterator<Item = Stamp> {
        let messages = self.measured.iter();
        messages.map(|message| Stamp::from_nanos(message.header.stamp.nanos()))
    }

    /// Stamps of the magnetometer's messages.
    pub fn magnetic_stamps(&self) -> impl Iterator<Item = Stamp> {
        let messages = self.magnetic.iter();
        messages.map(|message| Stamp::from_nanos(message.header.stamp.nanos()))
    }

    /// The reference and the readings as a diagnosis takes them.
    pub fn record(&self) -> PlacementRecord {
        let reading = |message: &Imu| Reading {
            specific_force: message.linear_acceleration.into(),
            angular_velocity: message.angular_velocity.into(),
        };
        PlacementRecord {
            name: self.name.clone(),
            reference: self.poses(),
            imu: MeasuredImu {
                stamps: self.measured_stamps().collect(),
                readings: self.measured.iter().map(reading).collect(),
                declared: self.declared(),
            },
            set_back: self.set_back.clone(),
            field: MeasuredField {
                stamps: self.magnetic_stamps().collect(),
                readings: self
                    .magnetic
                    .iter()
                    .map(|message| message.magnetic_field.into())
                    .collect(),
            },
        }
    }
}
