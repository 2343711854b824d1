//! The node `replay`: plays a motion file as `smpl/pose` (several people as
//! `person_NAME/smpl/pose`), or a bag with all its topics, with `/clock` and rosbag2's playback
//! services.

mod config;
mod motion;
mod outlet;
mod player;
mod services;
mod source;
mod system_clock;

use std::sync::Arc;
use std::time::Duration;

use cromosim_ros::{Bell, ClockPublisher, Node, Periodic, prepare};
use cromosim_spatial::Stamp;

pub use config::Config;
pub use motion::MotionSource;
pub use player::Player;
pub use source::{Item, Source};

use outlet::Outlet;
use services::Remote;
use system_clock::system_nanos;

const ABOUT: &str = "replay: plays a motion file as smpl/pose, each of several people as person_NAME/smpl/pose, or a bag with everything in it";
/// From ready to the first message, ns.
const LEAD: i64 = 20_000_000;
/// Silence between two rounds of a loop, ns: longer than any gap that a node bridges.
const PAUSE_BETWEEN_ROUNDS: i64 = 1_000_000_000;

/// Runs the node with these arguments until the end of what it plays, or until it is interrupted.
///
/// # Errors
/// What is wrong with the arguments or the file; what DDS refuses.
pub fn run(arguments: &[String]) -> anyhow::Result<()> {
    let Some(prepared) = prepare("replay", ABOUT, arguments, check)? else {
        return Ok(());
    };
    let source = Source::open(&prepared.config)?;
    let (node, config) = prepared.start()?;
    for line in source.describe().lines() {
        log::info!("{line}");
    }
    let outlet = Outlet::new(&node, &source, config.clock_rate_hz > 0.0)?;
    let clock = if config.clock_rate_hz > 0.0 {
        Some(node.clock_publisher()?)
    } else {
        None
    };
    wait_for_listeners(&node, &config, &outlet);
    cromosim_ros::say_ready();
    let bell = Bell::new();
    node.shutdown().ring_at_request(&bell);
    // A moment of lead, so that the first message is not late already.
    let player = Player::new(
        system_nanos() + LEAD,
        source.begins(),
        config.rate,
        config.start_paused,
    );
    let remote = Remote::new(player, source.begins()..=source.ends(), &bell);
    remote.take_up(&config).map_err(anyhow::Error::msg)?;
    let changed = remote.clone();
    node.parameters()
        .settable(&["rate", "loop"], move |config: Config| {
            changed.take_up(&config)
        })?;
    let _services = remote.serve(&node)?;
    let ended = Playback {
        node: &node,
        config: &config,
        source,
        outlet: &outlet,
        clock,
        remote: &remote,
        bell: &bell,
    }
    .play();
    outlet.wait_until_received(Duration::from_secs(2));
    ended
}

/// So that nobody misses the beginning.
fn wait_for_listeners(node: &Node, config: &Config, outlet: &Outlet) {
    let seconds = config.ready_timeout_seconds;
    let timeout = Duration::from_secs_f64(seconds);
    match usize::try_from(config.ready_subscriptions) {
        Ok(0) => {}
        Ok(count) => {
            if !outlet.wait_for_subscriptions(count, timeout) {
                log::warn!("begins without the {count} subscriptions it waited for");
            }
        }
        Err(_) => {
            log::info!("waits for whoever listens, at most {seconds} s (ready_timeout_seconds)");
            match outlet.wait_for_listeners(node, timeout) {
                (0, _) => log::warn!("begins although nobody listens"),
                (heard, all) => log::info!("begins; {heard} of {all} topics are listened to"),
            }
        }
    }
}

fn check(config: &Config) -> anyhow::Result<()> {
    config::check_rate(config.rate).map_err(anyhow::Error::msg)?;
    let not_negative = [
        ("start_seconds", config.start_seconds),
        ("duration_seconds", config.duration_seconds),
        ("clock_rate_hz", config.clock_rate_hz),
        ("unit_m", config.unit_m),
        ("ready_timeout_seconds", config.ready_timeout_seconds),
    ];
    for (name, value) in not_negative {
        anyhow::ensure!(
            value.is_finite() && value >= 0.0,
            "parameter '{name}': expected 0 or more, found {value}"
        );
    }
    let subscriptions = config.ready_subscriptions;
    anyhow::ensure!(
        subscriptions >= -1,
        "parameter 'ready_subscriptions': expected -1 or more, found {subscriptions}"
    );
    let patience = config.ready_timeout_seconds;
    anyhow::ensure!(
        patience <= 86_400.0,
        "parameter 'ready_timeout_seconds': expected at most a day (86400), found {patience}"
    );
    // Opened here too, so that --check-config finds what is wrong with the file.
    Source::open(config).map(drop)
}

struct Playback<'a> {
    node: &'a Node,
    config: &'a Config,
    source: Source,
    outlet: &'a Outlet,
    clock: Option<ClockPublisher>,
    remote: &'a Remote,
    bell: &'a Arc<Bell>,
}

impl Playback<'_> {
    fn play(&mut self) -> anyhow::Result<()> {
        let mut ticks = Periodic::new(self.config.clock_rate_hz);
        while !self.node.shutdown().is_requested() {
            if let Some(recorded) = self.remote.take_seek() {
                self.source.seek(recorded)?;
                self.remote.player().seek(system_nanos(), recorded);
            }
            if let (Some(clock), true) = (&self.clock, ticks.is_due()) {
                clock.publish(Stamp::from_nanos(
                    self.remote
                        .player()
                        .recorded_at(system_nanos())
                        .max(self.source.begins()),
                ))?;
            }
            let Some(due) = self.source.due() else {
                if !self.remote.loops() {
                    return Ok(());
                }
                self.begin_again()?;
                continue;
            };
            let burst = self.remote.take_burst();
            let wall = self.remote.player().wall_of(due);
            match wall {
                Some(wall) if wall <= system_nanos() => self.publish(due, wall)?,
                _ if burst => self.publish(due, system_nanos())?,
                _ => self.sleep(wall, &ticks),
            }
        }
        Ok(())
    }

    /// Publishes what is due. Live stamps are the times it was due at, not when the scheduler let
    /// it through: derivatives see jitter.
    fn publish(&mut self, due: i64, wall: i64) -> anyhow::Result<()> {
        let stamp = Stamp::from_nanos(if self.clock.is_some() { due } else { wall });
        if let Some(item) = self.source.take(stamp)? {
            self.outlet.publish(&item);
        }
        Ok(())
    }

    fn begin_again(&mut self) -> anyhow::Result<()> {
        let begins = self.source.begins();
        self.source.seek(begins)?;
        anyhow::ensure!(
            self.source.due().is_some(),
            "nothing to play again: the part that was chosen holds no messages"
        );
        self.remote
            .player()
            .seek(system_nanos() + PAUSE_BETWEEN_ROUNDS, begins);
        Ok(())
    }

    fn sleep(&self, wall: Option<i64>, ticks: &Periodic) {
        let until_due = wall
            .map(|wall| Duration::from_nanos(u64::try_from(wall - system_nanos()).unwrap_or(0)));
        let shortest = [until_due, ticks.left()].into_iter().flatten().min();
        self.bell.wait(shortest);
    }
}
