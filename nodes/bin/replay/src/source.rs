//! What is played: motions as poses, or everything in a bag.

use std::path::{Path, PathBuf};

use cromosim_bag::{BagReader, Message, Messages, Selection};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_recording::{is_bag, write_as_bag};
use cromosim_spatial::Stamp;
use tempfile::TempDir;

use crate::config::Config;
use crate::motion::MotionSource;

/// Everything that is played, in order of recorded time.
pub enum Source {
    /// The motion of a person, or of several.
    Motion(Box<MotionSource>),
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
        /// Where the bag lies that another file was made into; gone with the source.
        _folder: Option<TempDir>,
    },
}

/// One thing to publish.
pub enum Item {
    /// Of the person of this number.
    Pose(usize, Box<SmplPose>),
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
            return Ok(Self::Motion(Box::new(MotionSource::open(config)?)));
        }
        anyhow::ensure!(
            config.motion.is_empty(),
            "parameters 'motion' and 'bag' are both given; play one of them"
        );
        // The iterator borrows the reader, and both live as long as the process plays.
        let (path, folder) = as_bag(Path::new(&config.bag))?;
        let reader: &'static BagReader = Box::leak(Box::new(BagReader::open(&path)?));
        let Some((first, last)) = reader.summary().time_range else {
            anyhow::bail!("{}: the bag holds no messages", config.bag)
        };
        let from = first.plus_seconds(config.start_seconds);
        anyhow::ensure!(
            from <= last,
            "parameter 'start_seconds': {} s lies beyond the bag's end at {:.3} s",
            config.start_seconds,
            last - first
        );
        let until =
            (config.duration_seconds > 0.0).then(|| from.plus_seconds(config.duration_seconds));
        let topics = (!config.topics.is_empty()).then(|| config.topics.clone());
        let selection = Selection {
            topics,
            from: Some(from),
            until,
        };
        let mut messages = reader.messages(&selection)?;
        let next = messages.next().transpose()?;
        Ok(Self::Bag {
            reader,
            messages,
            next,
            selection,
            _folder: folder,
        })
    }

    /// Recorded time of the beginning, ns.
    pub fn begins(&self) -> i64 {
        match self {
            Self::Motion(motion) => motion.begins(),
            Self::Bag { selection, .. } => selection.from.map_or(0, |from| from.nanos),
        }
    }

    /// Recorded time of the end, ns.
    pub fn ends(&self) -> i64 {
        match self {
            Self::Motion(motion) => motion.ends(),
            Self::Bag { reader, .. } => reader
                .summary()
                .time_range
                .map_or(0, |(_, last)| last.nanos),
        }
    }

    /// Recorded time of what comes next, ns; none at the end.
    pub fn due(&self) -> Option<i64> {
        match self {
            Self::Motion(motion) => motion.due(),
            Self::Bag { next, .. } => next.as_ref().map(|message| message.log_time.nanos),
        }
    }

    /// What comes next; poses get `stamp`, messages of a bag stay as they were recorded.
    ///
    /// # Errors
    /// Where the bag is damaged.
    pub fn take(&mut self, stamp: Stamp) -> anyhow::Result<Option<Item>> {
        match self {
            Self::Motion(motion) => Ok(motion
                .take(stamp)
                .map(|(person, pose)| Item::Pose(person, Box::new(pose)))),
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
            Self::Motion(motion) => motion.seek(recorded),
            Self::Bag {
                reader,
                messages,
                next,
                selection,
                ..
            } => {
                let from = Stamp::from_nanos(recorded).max(selection.from.unwrap_or_default());
                *messages = reader.messages(&Selection {
                    from: Some(from),
                    ..selection.clone()
                })?;
                *next = messages.next().transpose()?;
            }
        }
        Ok(())
    }

    /// A line about what is played.
    pub fn describe(&self) -> String {
        match self {
            Self::Motion(motion) => motion.describe(),
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

/// A bag stays as it is; what else can be played as one is made into a bag in a folder of its own.
fn as_bag(path: &Path) -> anyhow::Result<(PathBuf, Option<TempDir>)> {
    if !is_bag(path) {
        let folder = tempfile::tempdir()?;
        let bag = folder.path().join("recording.mcap");
        if write_as_bag(path, &bag)? {
            return Ok((bag, Some(folder)));
        }
    }
    Ok((path.to_owned(), None))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn played(file: &str) -> Vec<(String, i64)> {
        let config = Config {
            bag: concat!(env!("CARGO_MANIFEST_DIR"), "/../../../tests/fuzz/samples/").to_owned()
                + file,
            ..Config::default()
        };
        let mut source = Source::open(&config).unwrap();
        let mut topics = Vec::new();
        while let Some(Item::Raw(message)) = source.take(Stamp::default()).unwrap() {
            topics.push((message.topic.name.clone(), message.log_time.nanos));
        }
        topics
    }

    #[test]
    fn trajectories_readings_and_data_sets_play_as_recordings() {
        let poses = played("tum/three_poses.txt");
        assert_eq!(poses.len(), 3);
        assert!(
            poses.iter().all(|(topic, _)| topic == "/reference/body")
                && poses.is_sorted_by_key(|(_, nanos)| *nanos),
            "{poses:?}"
        );
        let readings = played("euroc/imu.csv");
        assert!(
            !readings.is_empty()
                && readings
                    .iter()
                    .all(|(topic, _)| topic == "/imu/body/data_raw"),
            "{readings:?}"
        );
        let placements = played("datasets/pamap2.dat");
        assert!(
            placements
                .iter()
                .any(|(topic, _)| topic == "/imu/hand/data_raw")
                && placements.iter().all(|(_, nanos)| *nanos >= 1_000_000_000)
        );
    }

    #[test]
    fn what_is_none_of_these_is_said_to_be_no_bag() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notes.txt");
        std::fs::write(&path, "nothing that moves").unwrap();
        let error = Source::open(&Config {
            bag: path.display().to_string(),
            ..Config::default()
        })
        .err()
        .unwrap()
        .to_string();
        assert!(error.contains("notes.txt"), "{error}");
    }
}
