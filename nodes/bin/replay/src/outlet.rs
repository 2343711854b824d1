//! Where what is played goes.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use cromosim_bag::{QosProfile, Topic};
use cromosim_msgs::cromosim_msgs::SmplPose;
use cromosim_ros::{
    Durability, History, Node, Publisher, Qos, RawMessage, RawPublisher, Reliability, RosError,
};

use crate::source::{Item, Source};

/// Time for whoever listens to one topic to find the others; also for peers, which match a little
/// later than this side.
const QUIET: Duration = Duration::from_millis(500);

/// The publishers of a run.
pub struct Outlet {
    /// One a person.
    poses: Vec<Publisher<SmplPose>>,
    topics: BTreeMap<String, RawPublisher>,
}

impl Outlet {
    /// Publishers for everything that the source holds, but for `/clock` where `own_clock` says that
    /// there is another.
    ///
    /// # Errors
    /// What DDS refuses.
    pub fn new(node: &Node, source: &Source, own_clock: bool) -> Result<Self, RosError> {
        match source {
            Source::Motion(motion) => {
                let poses = motion
                    .topics()
                    .map(|topic| node.publisher(topic, Qos::reliable()))
                    .collect::<Result<_, _>>()?;
                Ok(Self {
                    poses,
                    topics: BTreeMap::new(),
                })
            }
            Source::Bag {
                reader, selection, ..
            } => {
                let mut topics = BTreeMap::new();
                for counted in &reader.summary().topics {
                    let topic = &counted.topic;
                    if selection
                        .topics
                        .as_ref()
                        .is_some_and(|wanted| !wanted.contains(&topic.name))
                    {
                        continue;
                    }
                    if own_clock && topic.name == "/clock" {
                        log::info!("leaves the bag's /clock out: clock_rate_hz publishes one");
                        continue;
                    }
                    topics.insert(
                        topic.name.clone(),
                        node.raw_publisher(&topic.name, &topic.type_name, offered(topic))?,
                    );
                }
                Ok(Self {
                    poses: Vec::new(),
                    topics,
                })
            }
        }
    }

    fn publishers(&self) -> impl Iterator<Item = &RawPublisher> {
        self.poses
            .iter()
            .map(|publisher| &**publisher)
            .chain(self.topics.values())
    }

    /// Waits until every publisher has `count` subscriptions; false where `timeout` was over.
    pub fn wait_for_subscriptions(&self, count: usize, timeout: Duration) -> bool {
        count == 0
            || self
                .publishers()
                .all(|publisher| publisher.wait_for_subscriptions(count, timeout))
    }

    /// Waits until somebody listens, and nobody new has come for a while; at most `timeout`. Counts
    /// the topics that are listened to, and all.
    pub fn wait_for_listeners(&self, node: &Node, timeout: Duration) -> (usize, usize) {
        let until = Instant::now() + timeout;
        let counts = || self.publishers().map(RawPublisher::subscription_count);
        let mut known = 0;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let patience = if known == 0 { left } else { left.min(QUIET) };
            if !node.wait_for_graph(patience, || counts().sum::<usize>() != known) {
                break;
            }
            known = counts().sum();
        }
        (
            counts().filter(|&count| count > 0).count(),
            counts().count(),
        )
    }

    /// Waits until what was published has been received, as far as subscriptions are reliable.
    pub fn wait_until_received(&self, timeout: Duration) {
        for publisher in self.publishers() {
            if !publisher.wait_for_acknowledgments(timeout) {
                log::warn!("{}: not everything was received in time", publisher.topic());
            }
        }
    }

    /// Publishes one thing; what does not get out is worth a line, and no more.
    pub fn publish(&self, item: &Item) {
        let sent = match item {
            Item::Pose(person, message) => {
                self.poses.get(*person).map(|poses| poses.publish(message))
            }
            Item::Raw(message) => self.topics.get(&message.topic.name).map(|publisher| {
                let raw = RawMessage::from_cdr(message.payload.clone())?;
                publisher.publish(raw)
            }),
        };
        if let Some(Err(error)) = sent {
            log::warn!("{error}");
        }
    }
}

/// What the topic's publishers offered when it was recorded; the first one stands for all.
fn offered(topic: &Topic) -> Qos {
    topic.qos().first().map_or_else(Qos::reliable, from_profile)
}

fn from_profile(profile: &QosProfile) -> Qos {
    let reliability = if profile.reliability == "best_effort" {
        Reliability::BestEffort
    } else {
        Reliability::Reliable
    };
    let durability = if profile.durability == "transient_local" {
        Durability::TransientLocal
    } else {
        Durability::Volatile
    };
    let history = if profile.history == "keep_all" {
        History::KeepAll
    } else {
        History::KeepLast(profile.depth.max(1))
    };
    Qos {
        reliability,
        durability,
        history,
        ..Qos::reliable()
    }
}
