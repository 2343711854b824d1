//! The node `smpl_state`: `smpl/pose` in; `smpl/state`, `/tf`, `/tf_static` and `/diagnostics` out.

mod config;
mod node;
mod shape;
mod smooth;

use std::path::Path;
use std::time::Duration;

use cromosim_body::BodyModel;
use cromosim_msgs::builtin_interfaces::Time;
use cromosim_msgs::cromosim_msgs::{SmplPose, SmplState};
use cromosim_msgs::diagnostic_msgs::DiagnosticArray;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_ros::{Node, Qos, RosError, prepare};

pub use config::Config;
pub use node::{Refusal, SmplStateNode, Step, pelvis_from_base_link};

const ABOUT: &str = "smpl_state: averages the shape, puts poses into the world, publishes smpl/state and the body's frames";

/// Runs the node with these arguments until it is interrupted.
///
/// # Errors
/// Wrong arguments, a body file that cannot be read, and errors of DDS.
pub fn run(arguments: &[String]) -> anyhow::Result<()> {
    let Some(prepared) = prepare("smpl_state", ABOUT, arguments, |config: &Config| {
        logic(config).map(drop)
    })?
    else {
        return Ok(());
    };
    let mut logic = logic(&prepared.config)?;
    let (node, config) = prepared.start()?;
    let poses = node.subscription::<SmplPose>("smpl/pose", Qos::reliable().depth(100))?;
    let states = node.publisher::<SmplState>("smpl/state", Qos::reliable())?;
    let frames = node.publisher::<TFMessage>("/tf", Qos::tf())?;
    let static_frames = node.publisher::<TFMessage>("/tf_static", Qos::tf_static())?;
    let diagnostics = node.publisher::<DiagnosticArray>("/diagnostics", Qos::reliable())?;
    static_frames.publish(&logic.static_frames(now(&node)))?;
    cromosim_ros::announce_ready(&node, &[&states], config.ready_subscriptions);

    let mut schedule = cromosim_ros::Periodic::new(config.diagnostics_rate_hz);
    let name = node.name().to_string();
    while !node.shutdown().is_requested() {
        match poses.recv_timeout(schedule.left().unwrap_or(Duration::from_secs(1))) {
            Ok(Some(pose)) => match logic.step(&pose.message) {
                Ok(step) => {
                    report(states.publish(&step.state));
                    report(frames.publish(&step.frames));
                }
                Err(refusal) => log::warn!("a pose is left out: {refusal}"),
            },
            Ok(None) => {}
            Err(error) => log::warn!("{error}"),
        }
        if schedule.is_due() {
            report(diagnostics.publish(&logic.diagnostics(now(&node), &name)));
        }
    }
    Ok(())
}

fn logic(config: &Config) -> anyhow::Result<SmplStateNode> {
    let checks = [
        ("smoothing_cutoff_hz", config.smoothing_cutoff_hz),
        ("diagnostics_rate_hz", config.diagnostics_rate_hz),
    ];
    for (name, value) in checks {
        anyhow::ensure!(
            value.is_finite() && value >= 0.0,
            "parameter '{name}': expected 0 or more, found {value}"
        );
    }
    for (name, values) in [
        ("source_position", config.source_position),
        ("source_rotvec", config.source_rotvec),
    ] {
        anyhow::ensure!(
            values.iter().all(|value| value.is_finite()),
            "parameter '{name}': expected finite numbers, found {values:?}"
        );
    }
    let model = if config.body.is_empty() {
        BodyModel::embedded()
    } else {
        BodyModel::read(Path::new(&config.body))?
    };
    let source_body = if config.source_body.is_empty() {
        None
    } else {
        Some(BodyModel::read(Path::new(&config.source_body))?)
    };
    Ok(SmplStateNode::new(config.clone(), model, source_body)?)
}

fn now(node: &Node) -> Time {
    Time::from_nanos(node.now().nanos)
}

/// A message that cannot be sent is worth a line in the log, no more: the next one may go out.
fn report(sent: Result<(), RosError>) {
    if let Err(error) = sent {
        log::warn!("{error}");
    }
}
