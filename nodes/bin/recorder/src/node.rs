//! From messages to a bag.

use std::collections::BTreeMap;
use std::path::Path;

use cromosim_bag::{
    BagError, BagOptions, BagSummary, BagWriter, Compression, QosProfile, Topic, TopicId,
};
use cromosim_msgs::std_msgs;
use cromosim_ros::{
    Durability, Endpoint, History, Qos, RawMessage, Received, Reliability, RosResult,
};
use cromosim_spatial::Stamp;

use crate::config::Config;
use crate::schema;

/// The attachment in which a bag carries its placements.
pub const PLACEMENTS_ATTACHMENT: &str = "placements.yaml";

/// Writes what it is given into a bag.
pub struct RecorderNode {
    config: Config,
    bag: BagWriter,
    topics: BTreeMap<String, TopicId>,
    placements: Option<String>,
}

impl RecorderNode {
    /// Starts the bag at `path`.
    ///
    /// # Errors
    /// Where something is there already, or cannot be made.
    pub fn new(config: Config, path: &Path) -> Result<Self, BagError> {
        let compression = if config.compression == "zstd" {
            Compression::Zstd
        } else {
            Compression::None
        };
        let mut bag = BagWriter::create(
            path,
            BagOptions {
                compression,
                live: true,
                replace: false,
            },
        )?;
        // Written first, so that a bag that is cut has it too.
        bag.write_metadata("cromosim", run_metadata(&config))?;
        bag.flush()?;
        Ok(Self {
            config,
            bag,
            topics: BTreeMap::new(),
            placements: None,
        })
    }

    /// Makes the names of the configuration absolute, as `resolve` knows the node's namespace and
    /// remaps.
    ///
    /// # Errors
    /// What `resolve` refuses.
    pub fn resolve_names(&mut self, resolve: impl Fn(&str) -> RosResult<String>) -> RosResult<()> {
        let Config {
            topics,
            exclude,
            placements_topic,
            ..
        } = &mut self.config;
        for name in topics.iter_mut().chain(exclude).chain([placements_topic]) {
            *name = resolve(name)?;
        }
        Ok(())
    }

    /// Whether a topic is to be recorded.
    pub fn wants(&self, topic: &str) -> bool {
        let infrastructure = matches!(topic, "/rosout" | "/parameter_events");
        let listed = self.config.topics.is_empty()
            || self.config.topics.iter().any(|wanted| wanted == topic);
        listed
            && !self.config.exclude.iter().any(|left_out| left_out == topic)
            && (self.config.include_infrastructure || !infrastructure)
    }

    /// Adds a topic, as its publishers offer it.
    ///
    /// # Errors
    /// [`BagError`]: the bag cannot be written.
    pub fn add_topic(
        &mut self,
        name: &str,
        type_name: &str,
        publishers: &[&Endpoint],
    ) -> Result<(), BagError> {
        let offered: Vec<QosProfile> = publishers
            .iter()
            .map(|publisher| profile(&publisher.qos))
            .collect();
        let topic: Topic = schema::describe(name, type_name).with_qos(&offered);
        let id = self.bag.add_topic(&topic)?;
        self.topics.insert(name.to_owned(), id);
        Ok(())
    }

    /// Writes a message: its log time is when it arrived, its publish time when it was sent.
    ///
    /// # Errors
    /// [`BagError`]: the bag cannot be written.
    pub fn record(&mut self, topic: &str, received: &Received<RawMessage>) -> Result<(), BagError> {
        let Some(&id) = self.topics.get(topic) else {
            return Ok(());
        };
        let published = received.source_stamp.unwrap_or(received.received_stamp);
        self.bag.write_payload(
            id,
            received.message.cdr(),
            received.received_stamp,
            published,
        )?;
        if topic == self.config.placements_topic {
            self.attach_placements(received)?;
        }
        Ok(())
    }

    fn attach_placements(&mut self, received: &Received<RawMessage>) -> Result<(), BagError> {
        let Ok(std_msgs::String { data: placements }) = received.message.decode() else {
            return Ok(());
        };
        if self.placements.as_ref() != Some(&placements) {
            self.bag.attach(
                PLACEMENTS_ATTACHMENT,
                "application/yaml",
                received.received_stamp,
                placements.as_bytes(),
            )?;
            self.placements = Some(placements);
        }
        Ok(())
    }

    /// What came before survives the end of this process from here on.
    ///
    /// # Errors
    /// [`BagError`]: the bag cannot be written.
    pub fn flush(&mut self) -> Result<(), BagError> {
        if self.config.sync {
            self.bag.sync()
        } else {
            self.bag.flush()
        }
    }

    /// Completes the bag.
    ///
    /// # Errors
    /// [`BagError`]: the bag cannot be written.
    pub fn finish(self) -> Result<BagSummary, BagError> {
        self.bag.finish()
    }
}

/// What a bag says about the run that made it.
fn run_metadata(config: &Config) -> BTreeMap<String, String> {
    let configuration = serde_norway::to_string(config).unwrap_or_default();
    BTreeMap::from([
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("seed".to_owned(), config.seed.to_string()),
        ("recorder".to_owned(), configuration),
        ("run".to_owned(), config.run.clone()),
    ])
}

fn profile(qos: &Qos) -> QosProfile {
    let depth = match qos.history {
        History::KeepLast(depth) => depth,
        History::KeepAll => 0,
    };
    let profile = QosProfile::reliable(depth);
    let profile = if qos.reliability == Reliability::BestEffort {
        profile.best_effort()
    } else {
        profile
    };
    if qos.durability == Durability::TransientLocal {
        profile.transient_local()
    } else {
        profile
    }
}

/// `rosbag2_2026_11_21-17_52_07` (UTC), where no name was given.
pub fn default_name(now: Stamp) -> String {
    let time = jiff::Timestamp::from_nanosecond(i128::from(now.nanos)).unwrap_or_default();
    time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_names_are_dates() {
        assert_eq!(
            default_name(Stamp::from_nanos(0)),
            "rosbag2_1970_01_01-00_00_00"
        );
        assert_eq!(
            default_name(Stamp::from_nanos(951_782_400 * 1_000_000_000)),
            "rosbag2_2000_02_29-00_00_00"
        );
        assert_eq!(
            default_name(Stamp::from_nanos(1_795_283_527 * 1_000_000_000)),
            "rosbag2_2026_11_21-17_52_07"
        );
    }
}
