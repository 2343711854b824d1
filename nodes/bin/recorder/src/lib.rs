//! The node `recorder`: any topic of any type into a rosbag2 MCAP.

mod config;
mod node;
mod schema;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use cromosim_ros::{Bell, Clock, Endpoint, Node, Periodic, RawSubscription, prepare};
use cromosim_spatial::Stamp;

pub use config::Config;
pub use node::{PLACEMENTS_ATTACHMENT, RecorderNode};

const ABOUT: &str = "recorder: any topic of any type into a rosbag2 bag (MCAP)";

/// Runs the node with these arguments until it is interrupted.
///
/// # Errors
/// What is wrong with the arguments; what DDS refuses; a disk that is full (what was written is
/// kept).
pub fn run(arguments: &[String]) -> anyhow::Result<()> {
    let Some(prepared) = prepare("recorder", ABOUT, arguments, check)? else {
        return Ok(());
    };
    let config = prepared.config.clone();
    let path = if config.bag_path.is_empty() {
        PathBuf::from(node::default_name(Clock::system_now()))
    } else {
        PathBuf::from(&config.bag_path)
    };
    let mut logic = RecorderNode::new(config.clone(), &path)?;
    let (node, _) = prepared.start()?;
    logic.resolve_names(|name| node.resolve(name))?;
    log::info!("records into {}", path.display());
    if node.clock().is_simulated() {
        log::info!("use_sim_time: waits for /clock, and takes the time from it");
    }
    let mut recording = Recording {
        bell: Bell::new(),
        subscriptions: BTreeMap::new(),
        node: &node,
        depth: u32::try_from(config.depth).unwrap_or(1000),
    };
    node.ring_at_graph_change(&recording.bell);
    node.shutdown().ring_at_request(&recording.bell);
    cromosim_ros::say_ready();
    let outcome = recording.run(&mut logic, config.flush_seconds);
    // Whatever happened: what is in the bag stays, and is closed where that is possible.
    let finished = logic.finish();
    outcome?;
    let summary = finished?;
    log::info!(
        "{}: {} messages on {} topics in {:.2} s",
        path.display(),
        summary.message_count(),
        summary.topics.len(),
        summary.duration()
    );
    Ok(())
}

fn check(config: &Config) -> anyhow::Result<()> {
    let flush = config.flush_seconds;
    anyhow::ensure!(
        flush > 0.0 && flush <= 3600.0,
        "parameter 'flush_seconds': expected more than 0 and at most 3600, found {flush}"
    );
    anyhow::ensure!(
        config.depth >= 1,
        "parameter 'depth': expected 1 or more, found {}",
        config.depth
    );
    let compression = config.compression.as_str();
    anyhow::ensure!(
        matches!(compression, "none" | "zstd"),
        "parameter 'compression': expected none or zstd, found '{compression}'"
    );
    let path = Path::new(&config.bag_path);
    anyhow::ensure!(
        config.bag_path.is_empty() || !path.exists(),
        "{}: there is something already; give another bag_path",
        path.display()
    );
    Ok(())
}

/// The subscriptions of a run; everything rings one bell.
struct Recording<'a> {
    node: &'a Node,
    bell: Arc<Bell>,
    subscriptions: BTreeMap<String, RawSubscription>,
    depth: u32,
}

impl Recording<'_> {
    fn run(&mut self, logic: &mut RecorderNode, flush_seconds: f64) -> anyhow::Result<()> {
        let mut flushes = Periodic::new(1.0 / flush_seconds);
        loop {
            let ending = self.node.shutdown().is_requested();
            self.look_for_topics(logic)?;
            self.drain(logic)?;
            if flushes.is_due() {
                logic.flush()?;
            }
            if ending {
                return Ok(());
            }
            self.bell
                .wait(flushes.left().or(Some(Duration::from_secs(1))));
        }
    }

    /// Subscribes to every topic that has come up.
    fn look_for_topics(&mut self, logic: &mut RecorderNode) -> anyhow::Result<()> {
        let publishers = self.node.publishers();
        for publisher in &publishers {
            let topic = &publisher.topic;
            if self.subscriptions.contains_key(topic)
                || !logic.wants(topic)
                || publisher.node.as_ref() == Some(self.node.name())
            {
                continue;
            }
            let all: Vec<&Endpoint> = publishers
                .iter()
                .filter(|other| other.topic == *topic && other.type_name == publisher.type_name)
                .collect();
            // What the weakest publisher offers is what all of them can give.
            let mut qos = publisher.qos.matching_subscription(self.depth);
            for other in &all {
                if !other.qos.satisfies(&qos) {
                    qos = other.qos.matching_subscription(self.depth);
                }
            }
            logic.add_topic(topic, &publisher.type_name, &all)?;
            let subscription = self
                .node
                .raw_subscription(topic, &publisher.type_name, qos)?;
            subscription.ring(self.bell.clone());
            self.subscriptions.insert(topic.clone(), subscription);
        }
        Ok(())
    }

    /// Writes what has come. While a simulated clock has not said anything, it stays in the queues.
    fn drain(&self, logic: &mut RecorderNode) -> anyhow::Result<()> {
        let clock = self.node.clock();
        if clock.is_simulated() && clock.now() <= Stamp::default() {
            return Ok(());
        }
        for (topic, subscription) in &self.subscriptions {
            while let Some(mut received) = subscription.try_recv()? {
                if clock.is_simulated() {
                    received.received_stamp = clock.now();
                    // The sender's is the system's time.
                    received.source_stamp = None;
                }
                logic.record(topic, &received)?;
            }
        }
        Ok(())
    }
}
