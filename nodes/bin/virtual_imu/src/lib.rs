//! The node `virtual_imu`: `smpl/state` in; `imu/NAME/data_raw` and `imu/NAME/data` of every
//! placement out, `imu/NAME/mag` where a device has a magnetometer and the field is known,
//! `imu/NAME/temperature` where it warms up, with their frames.

mod config;
mod node;
mod parts;
mod refusal;

use std::path::Path;
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Context;
use cromosim_body::BodyModel;
use cromosim_imu::{ImuMessages, MAX_RATE_HZ, Placement, PlacementSet, Scheme};
use cromosim_learned::scheme_for_networks;
use cromosim_msgs::RosMessage;
use cromosim_msgs::builtin_interfaces::Time;
use cromosim_msgs::cromosim_msgs::SmplState;
use cromosim_msgs::diagnostic_msgs::DiagnosticArray;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField, Temperature};
use cromosim_msgs::std_msgs;
use cromosim_msgs::tf2_msgs::TFMessage;
use cromosim_ros::{Durability, Node, Publisher, Qos, RosError, prepare};

pub use config::Config;
pub use node::{Step, VirtualImuNode};
pub use refusal::Refusal;

const ABOUT: &str = "virtual_imu: what IMUs on the body would measure, one sensor_msgs/Imu publisher for each placement";

/// How long the other readings of a state may stay behind `data_raw`, all placements together, as a
/// part of the interval between states: 1 ms at 100 Hz.
const RAW_AHEAD: f64 = 0.1;

/// What the node publishes.
struct Publishers {
    data_raw: Vec<Publisher<Imu>>,
    data: Vec<Publisher<Imu>>,
    /// By placement; none without a magnetometer or a known field.
    mag: Vec<Option<Publisher<MagneticField>>>,
    /// By placement; none of devices without a temperature.
    temperature: Vec<Option<Publisher<Temperature>>>,
    references: Vec<Publisher<PoseStamped>>,
    frames: Publisher<TFMessage>,
    diagnostics: Publisher<DiagnosticArray>,
    // Kept for late subscriptions.
    _static_frames: Option<Publisher<TFMessage>>,
}

impl Publishers {
    fn new(node: &Node, logic: &VirtualImuNode, config: &Config) -> Result<Self, RosError> {
        let topics = |ending: &str| {
            logic
                .placements()
                .iter()
                .map(move |placement| format!("imu/{}/{ending}", placement.name()))
                .collect::<Vec<_>>()
        };
        let imu = |ending| {
            topics(ending)
                .iter()
                .map(|topic| node.publisher::<Imu>(topic, Qos::reliable()))
                .collect::<Result<Vec<_>, _>>()
        };
        let reference = |placement: &Placement| {
            node.publisher::<PoseStamped>(
                &format!("reference/{}", placement.name()),
                Qos::reliable(),
            )
        };
        let referenced = if config.publish_reference {
            logic.placements()
        } else {
            &[]
        };
        let rigid = logic.static_frames(Time::from_nanos(node.now().nanos));
        let static_frames = if rigid.transforms.is_empty() {
            None
        } else {
            Some(node.publisher::<TFMessage>("/tf_static", Qos::tf_static())?)
        };
        static_frames
            .as_ref()
            .map(|publisher| publisher.publish(&rigid))
            .transpose()?;
        Ok(Self {
            data_raw: imu("data_raw")?,
            data: imu("data")?,
            mag: some(node, &topics("mag"), |it| logic.has_magnetometer(it))?,
            temperature: some(node, &topics("temperature"), |it| logic.warms_up(it))?,
            references: referenced.iter().map(reference).collect::<Result<_, _>>()?,
            frames: node.publisher("/tf", Qos::tf())?,
            diagnostics: node.publisher("/diagnostics", Qos::reliable())?,
            _static_frames: static_frames,
        })
    }

    /// What most stacks listen to goes first; what nobody listens to stays here. Each message costs
    /// those on their way with it some 30 us.
    fn publish_raw(&self, placement: usize, reading: &ImuMessages) {
        publish_if_heard(&self.data_raw[placement], &reading.data_raw);
    }

    /// All but `data_raw`.
    fn publish_rest(&self, step: &Step, state_interval: Duration) {
        let has_more = || step.readings.iter().any(|(it, _)| self.is_more_heard(*it));
        if step.readings.len() > 1 && has_more() {
            self.wait_until_raw_is_there(step, state_interval.mul_f64(RAW_AHEAD));
        }
        for (placement, reading) in &step.readings {
            publish_if_heard(&self.data[*placement], &reading.data);
            if let (Some(publisher), Some(mag)) = (&self.mag[*placement], &reading.mag) {
                publish_if_heard(publisher, mag);
            }
            let temperature = (&self.temperature[*placement], &reading.temperature);
            if let (Some(publisher), Some(temperature)) = temperature {
                publish_if_heard(publisher, temperature);
            }
        }
        if !step.frames.transforms.is_empty() {
            report(self.frames.publish(&step.frames));
        }
        for (publisher, reference) in self.references.iter().zip(&step.references) {
            report(publisher.publish(reference));
        }
    }

    /// True where somebody listens to more of a placement than `data_raw`.
    fn is_more_heard(&self, placement: usize) -> bool {
        is_heard(&self.data[placement])
            || self.mag[placement].as_ref().is_some_and(is_heard)
            || self.temperature[placement].as_ref().is_some_and(is_heard)
    }

    /// Until every reliable subscription has confirmed this state's `data_raw`, or `patience` is
    /// over.
    fn wait_until_raw_is_there(&self, step: &Step, patience: Duration) {
        let until = Instant::now() + patience;
        for (placement, _) in &step.readings {
            let left = until.saturating_duration_since(Instant::now());
            if !self.data_raw[*placement].wait_for_acknowledgments(left) {
                return;
            }
        }
    }
}

fn is_heard<M: RosMessage>(publisher: &Publisher<M>) -> bool {
    publisher.subscription_count() > 0
}

/// Publishers of the placements that have something to say; `topics` are in their order.
fn some<M: RosMessage>(
    node: &Node,
    topics: &[String],
    is_wanted: impl Fn(usize) -> bool,
) -> Result<Vec<Option<Publisher<M>>>, RosError> {
    let publisher = |(placement, topic): (usize, &String)| {
        let publisher = || node.publisher::<M>(topic, Qos::reliable());
        is_wanted(placement).then(publisher).transpose()
    };
    topics.iter().enumerate().map(publisher).collect()
}

fn publish_if_heard<M: RosMessage>(publisher: &Publisher<M>, message: &M) {
    // A transient-local publisher keeps its messages for those who come late.
    if is_heard(publisher) || publisher.qos().durability == Durability::TransientLocal {
        report(publisher.publish(message));
    }
}

/// Runs the node with these arguments until it is interrupted.
///
/// # Errors
/// What is wrong with the arguments, placements, devices or the body file; what DDS refuses.
pub fn run(arguments: &[String]) -> anyhow::Result<()> {
    let Some(prepared) = prepare("virtual_imu", ABOUT, arguments, |config: &Config| {
        logic(config).map(drop)
    })?
    else {
        return Ok(());
    };
    let (logic, named) = logic(&prepared.config)?;
    let (node, config) = prepared.start()?;
    let states = node.subscription::<SmplState>("smpl/state", Qos::reliable().depth(100))?;
    let publishers = Publishers::new(&node, &logic, &config)?;
    let logic = Arc::new(Mutex::new(logic));
    open_to_changes(&node, &logic, named, &config)?;
    let watched: Vec<_> = publishers
        .data_raw
        .iter()
        .map(|publisher| &**publisher)
        .collect();
    cromosim_ros::announce_ready(&node, &watched, config.ready_subscriptions);

    let mut schedule = cromosim_ros::Periodic::new(config.diagnostics_rate_hz);
    let name = node.name().to_string();
    while !node.shutdown().is_requested() {
        match states.recv_timeout(schedule.left().unwrap_or(Duration::from_secs(1))) {
            Ok(Some(state)) => {
                let mut publish_raw = |it, reading: &_| publishers.publish_raw(it, reading);
                let mut logic = lock(&logic);
                let step = logic.step_and_tell(&state.message, &mut publish_raw);
                let interval = logic.state_interval();
                drop(logic);
                match step {
                    Ok(step) => publishers.publish_rest(&step, interval),
                    Err(refusal) => log::warn!("a state is left out: {refusal}"),
                }
            }
            Ok(None) => {}
            Err(error) => log::warn!("{error}"),
        }
        if schedule.is_due() {
            report(
                publishers
                    .diagnostics
                    .publish(&lock(&logic).diagnostics(Time::from_nanos(node.now().nanos), &name)),
            );
        }
    }
    Ok(())
}

/// What may change at run time does so between two states; the placements' schemes are said anew.
fn open_to_changes(
    node: &Node,
    logic: &Arc<Mutex<VirtualImuNode>>,
    named: PlacementSet,
    config: &Config,
) -> anyhow::Result<()> {
    let described =
        node.publisher::<std_msgs::String>("virtual_imu/placements", Qos::tf_static())?;
    let describe = move |placements: &PlacementSet| {
        described.publish(&std_msgs::String {
            data: placements.to_yaml(),
        })
    };
    describe(&with_settings(named.clone(), config)?)?;
    let (logic, mut learned) = (Arc::clone(logic), config.learned.clone());
    let take_up = move |config: Config| {
        let placements =
            with_settings(named.clone(), &config).map_err(|error| format!("{error:#}"))?;
        let now = config.learned.clone();
        lock(&logic)
            .change(config, &placements)
            .map_err(|refusal| refusal.to_string())?;
        if learned != now {
            learned = now;
            report(describe(&placements));
        }
        Ok(())
    };
    node.parameters().settable(
        &[
            "noise",
            "seed",
            "learned",
            "mapping",
            "orientation",
            "device",
        ],
        take_up,
    )?;
    Ok(())
}

fn lock(logic: &Mutex<VirtualImuNode>) -> MutexGuard<'_, VirtualImuNode> {
    logic.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The placements of a configuration, with what it says for all of them.
///
/// # Errors
/// What is wrong with the file or a parameter.
pub fn placements(config: &Config) -> anyhow::Result<PlacementSet> {
    with_settings(named_placements(config)?, config)
}

fn named_placements(config: &Config) -> anyhow::Result<PlacementSet> {
    Ok(if config.placements.is_empty() {
        PlacementSet::demo()
    } else {
        PlacementSet::read(Path::new(&config.placements))?
    })
}

fn with_settings(read: PlacementSet, config: &Config) -> anyhow::Result<PlacementSet> {
    let rate_hz = config.rate_hz;
    anyhow::ensure!(
        (0.0..=MAX_RATE_HZ).contains(&rate_hz),
        "parameter 'rate_hz': expected a positive rate up to {MAX_RATE_HZ}, or 0 for that of each placement, found {rate_hz}"
    );
    let scheme = if config.scheme.is_empty() {
        None
    } else {
        Some(Scheme::from_str(&config.scheme).context("parameter 'scheme'")?)
    };
    Ok(read.map(|placement| {
        let rate_hz = if rate_hz > 0.0 {
            rate_hz
        } else {
            placement.rate_hz()
        };
        let scheme = scheme.unwrap_or_else(|| match config.learned.as_str() {
            "" => placement.scheme(),
            _ => scheme_for_networks(placement.scheme()),
        });
        placement.with_rate_hz(rate_hz).with_scheme(scheme)
    }))
}

/// The node, and the placements as their file has them.
fn logic(config: &Config) -> anyhow::Result<(VirtualImuNode, PlacementSet)> {
    let not_negative = [
        ("state_rate_hz", config.state_rate_hz),
        ("diagnostics_rate_hz", config.diagnostics_rate_hz),
        ("pose_error_correlation_s", config.pose_error_correlation_s),
    ];
    for (name, value) in not_negative {
        anyhow::ensure!(
            value.is_finite() && value >= 0.0,
            "parameter '{name}': expected 0 or more, found {value}"
        );
    }
    anyhow::ensure!(
        config.gap_seconds > 0.0,
        "parameter 'gap_seconds': expected more than 0, found {}",
        config.gap_seconds
    );
    let named = named_placements(config)?;
    let placements = with_settings(named.clone(), config)?;
    let model = if config.body.is_empty() {
        BodyModel::embedded()
    } else {
        BodyModel::read(Path::new(&config.body))?
    };
    let folder = Path::new(&config.placements)
        .parent()
        .unwrap_or(Path::new("."));
    Ok((
        VirtualImuNode::new(config.clone(), model, &placements, folder)?,
        named,
    ))
}

/// A message that does not get out is worth a line, and no more: the next one may.
fn report(sent: Result<(), RosError>) {
    if let Err(error) = sent {
        log::warn!("{error}");
    }
}
