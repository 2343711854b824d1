//! What is played: a motion as `smpl/pose`, or everything in a bag.

use std::path::{Path, PathBuf};

use cromosim_bag::{BagReader, Message, Messages, Selection};
use cromosim_body::BodyModel;
use cromosim_motion::{MotionOptions, SmplMotion, UpAxis, embedded_walk, read_motion_for};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_msgs::std_msgs::Header;
use cromosim_spatial::Stamp;

use crate::config::Config;

/// Recorded time of a motion's first frame: not zero, which TF takes for "the latest".
const MOTION_BEGINS: i64 = 1_000_000_000;

/// A motion with its times.
pub struct MotionSource {
    motion: SmplMotion,
    body_id: String,
    frame_id: String,
}

impl MotionSource {
    /// The motion that the configuration names.
    ///
    /// # Errors
    /// What is wrong with the file or the settings.
    pub fn open(config: &Config) -> anyhow::Result<Self> {
        let duration_s = (config.duration_seconds > 0.0).then_some(config.duration_seconds);
        let motion = if config.motion.is_empty() {
            embedded_walk().slice(config.start_seconds, duration_s)?
        } else {
            let up_axis = match config.up_axis.as_str() {
                "auto" => UpAxis::Detect,
                "x" => UpAxis::X,
                "y" => UpAxis::Y,
                "z" => UpAxis::Z,
                other => anyhow::bail!("parameter 'up_axis': expected auto, x, y or z, found '{other}'"),
            };
            let options = MotionOptions {
                skeleton_map: Some(config.skeleton_map.clone()).filter(|map| !map.is_empty()),
                up_axis,
                unit_scale_m: (config.unit_m > 0.0).then_some(config.unit_m),
                start_s: config.start_seconds,
                duration_s,
                skeleton: Some(&config.skeleton).filter(|file| !file.is_empty()).map(PathBuf::from),
                rate_hz: (config.motion_rate_hz > 0.0).then_some(config.motion_rate_hz),
                marker_set: Some(config.marker_set.clone()).filter(|set| !set.is_empty()),
                subject: Some(config.subject.clone()).filter(|name| !name.is_empty()),
                placements_as_given: config.placements_as_given,
                person: Some(config.person.clone()).filter(|name| !name.is_empty()),
                source_body: Some(&config.source_body).filter(|file| !file.is_empty()).map(PathBuf::from),
                ..MotionOptions::default()
            };
            let body = if config.body.is_empty() { BodyModel::embedded() } else { BodyModel::read(Path::new(&config.body))? };
            read_motion_for(Path::new(&config.motion), &body, &options)?
        };
        Ok(Self { motion, body_id: config.body_id.clone(), frame_id: config.frame_id.clone() })
    }

    /// A line about what is played.
    pub fn describe(&self) -> String {
        let motion = &self.motion;
        let report = motion.how_read().map(|report| format!("; {report}")).unwrap_or_default();
        format!("{}: {} frames at {:.2} Hz, {:.2} s{report}", motion.name, motion.frames.len(), motion.rate_hz, motion.duration_s())
    }

    fn recorded(&self, frame: usize) -> i64 {
        MOTION_BEGINS + (frame as f64 / self.motion.rate_hz * 1e9).round() as i64
    }

    fn message(&self, frame: usize, stamp: Stamp) -> SmplPose {
        let body = &self.motion.frames[frame];
        let mut message = SmplPose {
            header: Header::new(stamp.nanos, self.frame_id.clone()),
            body_id: self.body_id.clone(),
            gender: self.motion.gender.name().to_owned(),
            betas: self.motion.betas.clone(),
            confidence: self.motion.confidence.as_ref().map_or(1.0, |values| values[frame]),
            ..SmplPose::default()
        };
        message.set_root_and_rotations(body.root_position, &body.local_rotations);
        message
    }
}

/// Everything that is played, in order of recorded time.
pub enum Source {
    /// A motion.
    Motion {
        /// What to play.
        motion: Box<MotionSource>,
        /// The next frame.
        next: usize,
    },
    /// A bag.
    Bag {
        /// The bag, kept open for the whole run.
        reader: &'static BagReader,
        /// The messages still to come.
        messages: Messages<'static>,
        /// The next one.
        next: Option<Message>,
        /// What to play of it.
        selection: Selection,
    },
}

/// One thing to publish.
pub enum Item {
    /// On `smpl/pose`.
    Pose(Box<SmplPose>),
    /// On its own topic.
    Raw(Message),
}

impl Source {
    /// Opens what the configuration names.
    ///
    /// # Errors
    /// What is wrong with the file or the settings.
    pub fn open(config: &Config) -> anyhow::Result<Self> {
        if config.bag.is_empty() {
            return Ok(Self::Motion { motion: Box::new(MotionSource::open(config)?), next: 0 });
        }
        anyhow::ensure!(config.motion.is_empty(), "parameters 'motion' and 'bag' are both given; play one of them");
        // The iterator borrows the reader, and both live as long as the process plays.
        let reader: &'static BagReader = Box::leak(Box::new(BagReader::open(Path::new(&config.bag))?));
        let Some((first, last)) = reader.summary().time_range else { anyhow::bail!("{}: the bag holds no messages", config.bag) };
        let from = first.plus_seconds(config.start_seconds);
        anyhow::ensure!(
            from <= last,
            "parameter 'start_seconds': {} s lies beyond the bag's end at {:.3} s",
            config.start_seconds,
            last - first
        );
        let until = (config.duration_seconds > 0.0).then(|| from.plus_seconds(config.duration_seconds));
        let topics = (!config.topics.is_empty()).then(|| config.topics.clone());
        let selection = Selection { topics, from: Some(from), until };
        let mut messages = reader.messages(&selection)?;
        let next = messages.next().transpose()?;
        Ok(Self::Bag { reader, messages, next, selection })
    }

    /// Recorded time of the beginning, ns.
    pub fn begins(&self) -> i64 {
        match self {
            Self::Motion { motion, .. } => motion.recorded(0),
            Self::Bag { selection, .. } => selection.from.map_or(0, |from| from.nanos),
        }
    }

    /// Recorded time of the end, ns.
    pub fn ends(&self) -> i64 {
        match self {
            Self::Motion { motion, .. } => motion.recorded(motion.motion.frames.len().saturating_sub(1)),
            Self::Bag { reader, .. } => reader.summary().time_range.map_or(0, |(_, last)| last.nanos),
        }
    }

    /// Recorded time of what comes next, ns; none at the end.
    pub fn due(&self) -> Option<i64> {
        match self {
            Self::Motion { motion, next } => (*next < motion.motion.frames.len()).then(|| motion.recorded(*next)),
            Self::Bag { next, .. } => next.as_ref().map(|message| message.log_time.nanos),
        }
    }

    /// What comes next; poses get `stamp`, messages of a bag stay as they were recorded.
    ///
    /// # Errors
    /// Where the bag is damaged.
    pub fn take(&mut self, stamp: Stamp) -> anyhow::Result<Option<Item>> {
        match self {
            Self::Motion { motion, next } => {
                let item = (*next < motion.motion.frames.len()).then(|| Item::Pose(Box::new(motion.message(*next, stamp))));
                *next += 1;
                Ok(item)
            }
            Self::Bag { messages, next, .. } => {
                let item = next.take().map(Item::Raw);
                *next = messages.next().transpose()?;
                Ok(item)
            }
        }
    }

    /// Goes on at the first thing at or after `recorded` ns.
    ///
    /// # Errors
    /// Where the bag is damaged.
    pub fn seek(&mut self, recorded: i64) -> anyhow::Result<()> {
        match self {
            Self::Motion { motion, next } => {
                let frames = motion.motion.frames.len();
                *next = (0..frames).collect::<Vec<_>>().partition_point(|&frame| motion.recorded(frame) < recorded);
            }
            Self::Bag { reader, messages, next, selection } => {
                let from = Stamp::from_nanos(recorded).max(selection.from.unwrap_or_default());
                *messages = reader.messages(&Selection { from: Some(from), ..selection.clone() })?;
                *next = messages.next().transpose()?;
            }
        }
        Ok(())
    }

    /// A line about what is played.
    pub fn describe(&self) -> String {
        match self {
            Self::Motion { motion, .. } => motion.describe(),
            Self::Bag { reader, .. } => {
                let summary = reader.summary();
                format!(
                    "{}: {} topics, {} messages, {:.2} s",
                    reader.path().display(),
                    summary.topics.len(),
                    summary.message_count(),
                    summary.duration()
                )
            }
        }
    }
}
