//! The messages of simulated people in a bag: made and encoded on all cores in blocks of time, while
//! the block before is written, so that memory does not grow with the motion's length.

use cromosim_bag::{BagWriter, Topic, TopicId, payload_of};
use cromosim_imu::{ImuMessages, MountedSensors, SensorPose};
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField, Temperature};
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;
use rayon::prelude::*;

use crate::{PlayedPerson, RecordingError, SimulatedPerson, SimulatedPlacement};

/// About so many messages are a block: 10 to 20 MB.
const BLOCK_MESSAGES: f64 = 20_000.0;

/// An encoded message. Of one time, people come in their order, of each its state first, then by
/// placement its reference and its samples.
struct Encoded {
    nanos: i64,
    rank: usize,
    topic: usize,
    payload: Vec<u8>,
}

/// Messages that were not taken yet.
enum Source<'a> {
    Frames(Frames<'a>),
    Samples(Box<Samples<'a>>),
}

/// A person's states and references.
struct Frames<'a> {
    person: &'a PlayedPerson,
    sites: &'a MountedSensors,
    next: usize,
    /// Of the state, as the topic.
    rank: usize,
}

/// A placement's samples.
struct Samples<'a> {
    placement: &'a mut SimulatedPlacement,
    /// Taken, but later than the last block.
    pending: Option<ImuMessages>,
    rank: usize,
}

/// Writes the messages in order of time; of one time each person's state first, then each
/// placement's. Between blocks of them `check` is called.
///
/// # Errors
/// Of `check`, of the bag, and [`RecordingError::PutAside`] where what was put aside is lost.
pub fn write_people<E: From<RecordingError>>(
    bag: &mut BagWriter,
    people: &[PlayedPerson],
    simulated: &mut [SimulatedPerson],
    check: impl Fn() -> Result<(), E>,
) -> Result<(), E> {
    let topics = topics(people, simulated);
    let mut ids = vec![None; topics.len()];
    let mut blocks = Blocks::new(people, simulated, &topics);
    let mut block = blocks.next()?;
    while let Some(ready) = block {
        check()?;
        let write = || write_block(bag, &topics, &mut ids, ready);
        let (written, next) = rayon::join(write, || blocks.next());
        written?;
        block = next?;
    }
    Ok(())
}

/// Topics of each placement, see [`topics`].
const PLACEMENT_TOPICS: usize = 5;

/// Of each person: of the states, then of each placement's reference, `data_raw`, `data`, `mag` and
/// `temperature`. Their places are the ranks of messages.
fn topics(people: &[PlayedPerson], simulated: &[SimulatedPerson]) -> Vec<Topic> {
    let mut topics = Vec::new();
    for (person, simulated) in people.iter().zip(simulated) {
        topics.push(Topic::for_message::<SmplState>(&person.topic("smpl/state")));
        for SimulatedPlacement { name, .. } in &simulated.placements {
            let reference = person.topic(&format!("reference/{name}"));
            topics.push(Topic::for_message::<PoseStamped>(&reference));
            for ending in ["data_raw", "data"] {
                let imu = person.topic(&format!("imu/{name}/{ending}"));
                topics.push(Topic::for_message::<Imu>(&imu));
            }
            let mag = person.topic(&format!("imu/{name}/mag"));
            topics.push(Topic::for_message::<MagneticField>(&mag));
            let temperature = person.topic(&format!("imu/{name}/temperature"));
            topics.push(Topic::for_message::<Temperature>(&temperature));
        }
    }
    topics
}

/// Topics are announced with their first message.
fn write_block(
    bag: &mut BagWriter,
    topics: &[Topic],
    ids: &mut [Option<TopicId>],
    block: Vec<Encoded>,
) -> Result<(), RecordingError> {
    for message in block {
        let id = match ids[message.topic] {
            Some(id) => id,
            None => *ids[message.topic].insert(bag.add_topic(&topics[message.topic])?),
        };
        let stamp = Stamp::from_nanos(message.nanos);
        bag.write_payload(id, &message.payload, stamp, stamp)?;
    }
    Ok(())
}

/// All messages, a block of time after the other.
struct Blocks<'a> {
    sources: Vec<Source<'a>>,
    topics: &'a [Topic],
    /// Where the next block ends.
    end: Stamp,
    step_s: f64,
}

impl<'a> Blocks<'a> {
    fn new(
        people: &'a [PlayedPerson],
        simulated: &'a mut [SimulatedPerson],
        topics: &'a [Topic],
    ) -> Self {
        let (mut sources, mut messages, mut rank) = (Vec::new(), 0, 0);
        let [mut first, mut last] = [Stamp::from_nanos(i64::MAX), Stamp::from_nanos(i64::MIN)];
        for (person, simulated) in people.iter().zip(simulated) {
            let played = person.played.clone();
            first = first.min(person.stamps[*played.start()]);
            last = last.max(person.stamps[*played.end()]);
            messages += played.clone().count() * (1 + simulated.placements.len());
            sources.push(Source::Frames(Frames {
                person,
                sites: &simulated.sites,
                next: *played.start(),
                rank,
            }));
            rank += 1;
            for placement in &mut simulated.placements {
                messages += 2 * placement.motion.count();
                sources.push(Source::Samples(Box::new(Samples {
                    placement,
                    pending: None,
                    rank,
                })));
                rank += PLACEMENT_TOPICS;
            }
        }
        let step_s = (last - first).max(1e-3) * (BLOCK_MESSAGES / messages.max(1) as f64).min(1.0);
        Self {
            sources,
            topics,
            end: first.plus_seconds(step_s),
            step_s,
        }
    }

    /// The next block, in order; none after the last.
    fn next(&mut self) -> Result<Option<Vec<Encoded>>, RecordingError> {
        if self.sources.is_empty() {
            return Ok(None);
        }
        let (topics, end) = (self.topics, self.end);
        let taken: Vec<Vec<Encoded>> = self
            .sources
            .par_iter_mut()
            .map(|source| source.until(end, topics))
            .collect::<Result<_, _>>()?;
        let mut block: Vec<Encoded> = taken.into_iter().flatten().collect();
        block.par_sort_by_key(|message| (message.nanos, message.rank));
        self.sources.retain(|source| !source.is_empty());
        self.end = end.plus_seconds(self.step_s);
        Ok(Some(block))
    }
}

impl Source<'_> {
    /// The messages before `end`, encoded.
    fn until(&mut self, end: Stamp, topics: &[Topic]) -> Result<Vec<Encoded>, RecordingError> {
        match self {
            Self::Frames(frames) => frames.until(end, topics),
            Self::Samples(samples) => samples.until(end, topics),
        }
    }

    fn is_empty(&self) -> bool {
        match self {
            Self::Frames(frames) => frames.next > *frames.person.played.end(),
            Self::Samples(samples) => {
                samples.pending.is_none() && samples.placement.motion.is_empty()
            }
        }
    }
}

impl Frames<'_> {
    fn until(&mut self, end: Stamp, topics: &[Topic]) -> Result<Vec<Encoded>, RecordingError> {
        let PlayedPerson {
            motion,
            stamps,
            played,
            ..
        } = self.person;
        let first = self.next;
        let played = first..=*played.end();
        self.next = first + played.take_while(|frame| stamps[*frame] < end).count();
        let rank = self.rank;
        let of_frame = |frame: usize| {
            let stamp = stamps[frame];
            let state = encoded(&self.person.state(frame), stamp, [rank, rank], topics)?;
            let poses = self.sites.poses(&motion.frames[frame]);
            let reference = |(index, pose): (usize, &SensorPose)| {
                let message = PoseStamped {
                    header: Header::new(stamp.nanos, "world"),
                    pose: pose.world_from_sensor.into(),
                };
                encoded(
                    &message,
                    stamp,
                    [rank + 1 + PLACEMENT_TOPICS * index; 2],
                    topics,
                )
            };
            let references = poses.iter().enumerate().map(reference);
            std::iter::once(Ok(state))
                .chain(references)
                .collect::<Result<Vec<Encoded>, RecordingError>>()
        };
        let frames: Vec<Vec<Encoded>> = (first..self.next)
            .into_par_iter()
            .map(of_frame)
            .collect::<Result<_, _>>()?;
        Ok(frames.into_iter().flatten().collect())
    }
}

impl Samples<'_> {
    fn until(&mut self, end: Stamp, topics: &[Topic]) -> Result<Vec<Encoded>, RecordingError> {
        let mut taken = Vec::new();
        loop {
            let Some(messages) = self.next_messages()? else {
                return Ok(taken);
            };
            let stamp = Stamp::from_nanos(messages.data_raw.header.stamp.nanos());
            if stamp >= end {
                self.pending = Some(messages);
                return Ok(taken);
            }
            let rank = self.rank + 1;
            taken.push(encoded(
                &messages.data_raw,
                stamp,
                [rank, self.rank + 1],
                topics,
            )?);
            taken.push(encoded(
                &messages.data,
                stamp,
                [rank, self.rank + 2],
                topics,
            )?);
            if let Some(mag) = &messages.mag {
                taken.push(encoded(mag, stamp, [rank, self.rank + 3], topics)?);
            }
            if let Some(temperature) = &messages.temperature {
                taken.push(encoded(temperature, stamp, [rank, self.rank + 4], topics)?);
            }
        }
    }

    /// The messages of the next sample that the device does not lose.
    fn next_messages(&mut self) -> Result<Option<ImuMessages>, RecordingError> {
        if let Some(messages) = self.pending.take() {
            return Ok(Some(messages));
        }
        self.placement.next_messages()
    }
}

fn encoded<M: RosMessage>(
    message: &M,
    stamp: Stamp,
    [rank, topic]: [usize; 2],
    topics: &[Topic],
) -> Result<Encoded, RecordingError> {
    Ok(Encoded {
        nanos: stamp.nanos,
        rank,
        topic,
        payload: payload_of(&topics[topic].name, message)?,
    })
}
