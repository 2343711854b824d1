//! The node `viewer`: body, sensors and curves in Rerun, live by gRPC or into a file.

mod config;
mod node;

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use cromosim_body::BodyModel;
use cromosim_msgs::RosMessage;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_ros::{Bell, Node, Periodic, Qos, Received, RosError, Subscription, prepare};
use cromosim_view::{Destination, Recording, RecordingOptions};

pub use config::Config;
pub use node::{Refusal, ViewerNode};

const ABOUT: &str =
    "viewer: the moving body, sensor frames and IMU curves in Rerun, live or into a file";
const FLUSH_RATE_HZ: f64 = 4.0;

/// What the node listens to; everything rings one bell.
struct Listeners {
    node: Node,
    bell: Arc<Bell>,
    states: Subscription<SmplState>,
    frames: Vec<Subscription<TFMessage>>,
    /// By topic: the placement's name and its samples.
    imus: BTreeMap<String, (String, Subscription<Imu>)>,
}

impl Listeners {
    fn new(node: &Node) -> Result<Self, RosError> {
        let bell = Bell::new();
        let states = node.subscription::<SmplState>("smpl/state", Qos::reliable().depth(100))?;
        states.ring(bell.clone());
        let frames = vec![
            node.subscription::<TFMessage>("/tf", Qos::tf())?,
            node.subscription::<TFMessage>("/tf_static", Qos::tf_static().depth(100))?,
        ];
        frames
            .iter()
            .for_each(|subscription| subscription.ring(bell.clone()));
        node.ring_at_graph_change(&bell);
        Ok(Self {
            node: node.clone(),
            bell,
            states,
            frames,
            imus: BTreeMap::new(),
        })
    }

    /// Listens to every IMU that has come up: `.../NAME/data_raw`.
    fn look_for_imus(&mut self) -> Result<(), RosError> {
        for publisher in self.node.publishers() {
            let Some(placement) = publisher
                .topic
                .strip_suffix("/data_raw")
                .and_then(|path| path.rsplit('/').next())
            else {
                continue;
            };
            if publisher.type_name != Imu::TYPE_NAME || self.imus.contains_key(&publisher.topic) {
                continue;
            }
            let qos = publisher.qos.matching_subscription(1000);
            let subscription = self.node.subscription::<Imu>(&publisher.topic, qos)?;
            subscription.ring(self.bell.clone());
            log::info!("shows {}", publisher.topic);
            self.imus.insert(
                publisher.topic.clone(),
                (placement.to_owned(), subscription),
            );
        }
        Ok(())
    }

    /// Hands everything that has come to the node's logic.
    fn drain(&self, logic: &mut ViewerNode) -> anyhow::Result<()> {
        for subscription in &self.frames {
            while let Some(received) = next(subscription) {
                logic.learn_frames(&received.message);
            }
        }
        while let Some(received) = next(&self.states) {
            tolerate(logic.show_state(&received.message))?;
        }
        for (placement, subscription) in self.imus.values() {
            while let Some(received) = next(subscription) {
                tolerate(logic.show_imu(placement, &received.message))?;
            }
        }
        Ok(())
    }
}

/// The next message; what cannot be read is worth a line, and those after it are looked at in the
/// next round.
fn next<M: RosMessage>(subscription: &Subscription<M>) -> Option<Received<M>> {
    subscription.try_recv().unwrap_or_else(|error| {
        log::warn!("{error}");
        None
    })
}

/// A message that makes no sense is worth a line; a recording that is lost ends the node.
fn tolerate(shown: Result<(), Refusal>) -> Result<(), Refusal> {
    match shown {
        Err(refusal @ (Refusal::State(_) | Refusal::Body(_))) => {
            log::warn!("a state is not shown: {refusal}");
            Ok(())
        }
        other => other,
    }
}

/// Runs the node with these arguments until it is interrupted.
///
/// # Errors
/// What is wrong with the arguments; what DDS or Rerun refuses.
pub fn run(arguments: &[String]) -> anyhow::Result<()> {
    let check = |config: &Config| -> anyhow::Result<()> {
        let rate_hz = config.mesh_rate_hz;
        anyhow::ensure!(
            rate_hz.is_finite() && rate_hz > 0.0,
            "parameter 'mesh_rate_hz': expected a positive rate, found {rate_hz}"
        );
        let window = config.curve_window_seconds;
        anyhow::ensure!(
            window.is_finite() && window > 0.0,
            "parameter 'curve_window_seconds': expected more than 0, found {window}"
        );
        destination(config).map(drop)
    };
    let Some(prepared) = prepare("viewer", ABOUT, arguments, check)? else {
        return Ok(());
    };
    let config = prepared.config.clone();
    let model = if config.body.is_empty() {
        BodyModel::embedded()
    } else {
        BodyModel::read(Path::new(&config.body))?
    };
    let destination = destination(&config)?;
    let curve_window_s = destination.is_live().then_some(config.curve_window_seconds);
    let options = RecordingOptions {
        frame_rate_hz: config.mesh_rate_hz,
        curve_window_s,
        ..RecordingOptions::default()
    };
    let recording = Recording::open(std::slice::from_ref(&destination), options)?;
    let mut logic = ViewerNode::new(config, model, recording)?;
    let (node, _) = prepared.start()?;
    let mut listeners = Listeners::new(&node)?;
    cromosim_ros::say_ready();
    let outcome = listen(&node, &mut listeners, &mut logic);
    let finished = logic.finish();
    outcome?;
    let summary = finished?;
    log::info!(
        "{destination}: {} frames of the body, {} IMU samples",
        summary.body_frames,
        summary.imu_samples
    );
    Ok(())
}

fn listen(node: &Node, listeners: &mut Listeners, logic: &mut ViewerNode) -> anyhow::Result<()> {
    let mut flushes = Periodic::new(FLUSH_RATE_HZ);
    loop {
        listeners.look_for_imus()?;
        listeners.drain(logic)?;
        if flushes.is_due() {
            logic.flush()?;
        }
        if node.shutdown().is_requested() {
            return Ok(());
        }
        listeners
            .bell
            .wait(flushes.left().or(Some(Duration::from_secs(1))));
    }
}

fn destination(config: &Config) -> anyhow::Result<Destination> {
    if !config.recording.is_empty() {
        return Ok(Destination::File {
            path: config.recording.clone().into(),
        });
    }
    let address: SocketAddr = config.connect.parse().with_context(|| {
        format!(
            "parameter 'connect': '{}': expected ADDRESS:PORT",
            config.connect
        )
    })?;
    Ok(Destination::Connect { address })
}
