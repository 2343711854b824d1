//! The node `gap_monitor`: real and virtual IMU messages in; how far they lie apart, and the first
//! cause, on `/diagnostics` out.

mod config;
mod node;

use std::time::Duration;

use cromosim_msgs::diagnostic_msgs::DiagnosticArray;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_ros::{Bell, Node, Periodic, Qos, RosError, Subscription, prepare};

pub use config::Config;
pub use node::{GapMonitorNode, Source};

const ABOUT: &str =
    "gap_monitor: how far real and virtual IMUs lie apart, and the first cause, on /diagnostics";
/// Messages that wait while a window is assessed.
const DEPTH: u32 = 1000;

/// How often messages are fetched, Hz: waking up for each of them would cost more than the
/// comparison.
const FETCH_RATE_HZ: f64 = 20.0;

/// Both streams of all placements.
struct Listeners {
    streams: Vec<(usize, Source, Subscription<Imu>)>,
}

impl Listeners {
    fn new(node: &Node, config: &Config) -> Result<Self, RosError> {
        let mut listeners = Self {
            streams: Vec::new(),
        };
        for (placement, name) in config.placements.iter().enumerate() {
            for (source, topic) in [Source::Measured, Source::Simulated]
                .into_iter()
                .zip(config.topics(name))
            {
                // Drivers of real IMUs often publish with best effort; such a subscription matches
                // every publisher.
                let subscription =
                    node.subscription::<Imu>(&topic, Qos::sensor_data().depth(DEPTH))?;
                listeners.streams.push((placement, source, subscription));
            }
        }
        Ok(listeners)
    }

    fn drain(&self, node: &Node, logic: &mut GapMonitorNode) {
        for (placement, source, subscription) in &self.streams {
            loop {
                match subscription.try_recv() {
                    Ok(Some(received)) => {
                        logic.take(*placement, *source, &received.message, node.now())
                    }
                    Ok(None) => break,
                    Err(error) => {
                        log::warn!("{error}");
                        break;
                    }
                }
            }
        }
    }
}

/// Runs the node with these arguments until it is interrupted.
///
/// # Errors
/// What is wrong with the arguments; what DDS refuses.
pub fn run(arguments: &[String]) -> anyhow::Result<()> {
    let Some(prepared) = prepare("gap_monitor", ABOUT, arguments, Config::check)? else {
        return Ok(());
    };
    let (node, config) = prepared.start()?;
    let listeners = Listeners::new(&node, &config)?;
    let diagnostics = node.publisher::<DiagnosticArray>("/diagnostics", Qos::reliable())?;
    let mut logic = GapMonitorNode::new(config.clone());
    let mut schedule = Periodic::new(config.rate_hz);
    let name = node.name().to_string();
    let bell = Bell::new();
    node.shutdown().ring_at_request(&bell);
    cromosim_ros::say_ready();
    while !node.shutdown().is_requested() {
        listeners.drain(&node, &mut logic);
        if schedule.is_due() {
            // A message that does not get out is worth a line, and no more: the next one may.
            diagnostics
                .publish(&logic.diagnostics(node.now(), &name))
                .unwrap_or_else(|error| log::warn!("{error}"));
        }
        let fetch = Duration::from_secs_f64(1.0 / FETCH_RATE_HZ);
        bell.wait(Some(schedule.left().map_or(fetch, |left| left.min(fetch))));
    }
    Ok(())
}
