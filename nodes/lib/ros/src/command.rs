//! What every node's program does before it runs: help, parameters, checks.

use std::io::{ErrorKind, Write, stdout};
use std::time::{Duration, Instant};

use cromosim_msgs::printable;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::args::RosArgs;
use crate::error::{RosError, RosResult};
use crate::logging::init_logging;
use crate::node::Node;
use crate::node_options::NodeOptions;
use crate::parameter::Parameters;
use crate::publisher::RawPublisher;
use crate::shutdown::Shutdown;

/// Columns of the screen that `-h` fits, and how many of them names may push descriptions away.
const SCREEN_COLUMNS: usize = 100;
const MAX_FIELD_COLUMNS: usize = 36;

/// The parameters of a node as a struct; [`node_config!`](crate::node_config) makes one.
pub trait NodeConfig: Default + Serialize + DeserializeOwned {
    /// Name and description of every parameter, in the struct's order.
    const ABOUT: &'static [(&'static str, &'static str)];
}

/// Defines the parameters of a node: `/// description` then `pub name: Type = default,` for each.
/// The descriptions become the struct's documentation, the node's `--help` and what `ros2 param
/// describe` says.
#[macro_export]
macro_rules! node_config {
    ($(#[$meta:meta])* pub struct $name:ident { $( $(#[doc = $about:literal])+ pub $field:ident: $ty:ty = $default:expr, )* }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, ::serde::Deserialize, ::serde::Serialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name { $( $(#[doc = $about])+ pub $field: $ty, )* }

        impl Default for $name {
            fn default() -> Self {
                Self { $( $field: $default, )* }
            }
        }

        impl $crate::NodeConfig for $name {
            const ABOUT: &'static [(&'static str, &'static str)] = &[ $( (stringify!($field), concat!($($about),+)), )* ];
        }
    };
}

/// A node that is about to start: its configuration is read and checked, DDS is not yet touched.
pub struct Prepared<C> {
    /// The configuration.
    pub config: C,
    options: NodeOptions,
    ends_with_stdin: bool,
}

impl<C> Prepared<C> {
    /// Starts the node; SIGINT and SIGTERM end it, and `--end-with-stdin` where that is given.
    ///
    /// # Errors
    /// As [`Node::start`].
    pub fn start(self) -> RosResult<(Node, C)> {
        let shutdown = Shutdown::on_signals()?;
        if self.ends_with_stdin {
            shutdown.request_at_end_of_input()?;
        }
        let options = self.options.shutdown(&shutdown);
        Ok((Node::start(options)?, self.config))
    }
}

/// Reads a node's command line: `--help` prints what it takes, `-h` so much of that as fits a screen,
/// `--check-config` checks and prints the configuration; all give `None`. `check` finds what is wrong beyond types: files that are
/// not there, values out of range.
///
/// # Errors
/// One line that names the argument or the file, and what `check` says.
pub fn prepare<C: NodeConfig, E: From<RosError>>(
    name: &str,
    about: &str,
    arguments: &[String],
    check: impl FnOnce(&C) -> Result<(), E>,
) -> Result<Option<Prepared<C>>, E> {
    let args = RosArgs::parse(arguments.iter().cloned())?;
    let has = |flag: &str| args.rest.iter().any(|argument| argument == flag);
    if has("--help") {
        print_line(&help::<C>(name, about))?;
        return Ok(None);
    }
    if has("-h") {
        print_line(&short_help::<C>(name, about))?;
        return Ok(None);
    }
    let known = |argument: &str| matches!(argument, "--check-config" | "--end-with-stdin");
    if let Some(unknown) = args.rest.iter().find(|argument| !known(argument)) {
        let problem =
            "not known here; parameters go after --ros-args as -p NAME:=VALUE (see --help)"
                .to_owned();
        return Err(RosError::Argument {
            place: unknown.clone(),
            problem,
        }
        .into());
    }
    init_logging(&args.log_levels);
    let parameters = Parameters::new();
    parameters.declare_config(&C::default())?;
    for (field, about) in C::ABOUT {
        parameters.amend(plain(field), |parameter| parameter.about(about.trim()))?;
    }
    let options = NodeOptions::new(name, &args, &parameters)?;
    let config: C = parameters.config()?;
    check(&config)?;
    if has("--check-config") {
        print_line(&format!("{}: the configuration is valid", options.name))?;
        return Ok(None);
    }
    Ok(Some(Prepared {
        config,
        options,
        ends_with_stdin: has("--end-with-stdin"),
    }))
}

/// A line on standard output. That nobody reads it (`--help | head -1`) is no fault.
fn print_line(line: &str) -> RosResult<()> {
    match writeln!(stdout(), "{line}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(RosError::Argument {
            place: "standard output".to_owned(),
            problem: format!("cannot be written: {error}"),
        }),
        _ => Ok(()),
    }
}

/// Prints the line `ready` on standard output, for whoever started the process; a node runs on where
/// nobody is there to read it.
pub fn say_ready() {
    let _ = writeln!(stdout(), "ready");
}

/// `r#loop` -> `loop`.
fn plain(field: &str) -> &str {
    field.trim_start_matches("r#")
}

/// Name, default and description of every parameter.
fn parameters<C: NodeConfig>() -> Vec<(&'static str, String, &'static str)> {
    let defaults = serde_norway::to_value(C::default()).unwrap_or_default();
    let shown = |field: &str| {
        let value = defaults
            .get(field)
            .map(|value| serde_norway::to_string(value).unwrap_or_default())
            .unwrap_or_default();
        value.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let of = |&(field, about): &(&'static str, &'static str)| {
        let field = plain(field);
        (field, shown(field), about.trim())
    };
    C::ABOUT.iter().map(of).collect()
}

/// A line for each parameter, none wider than the screen.
fn short_help<C: NodeConfig>(name: &str, about: &str) -> String {
    let mut rows: Vec<(String, &str)> = parameters::<C>()
        .into_iter()
        .map(|(field, default, about)| (format!("{field} [{default}]"), about))
        .collect();
    rows.push((
        "use_sim_time [false]".to_owned(),
        "Take the time from /clock.",
    ));
    let widths = rows.iter().map(|(field, _)| field.chars().count());
    let width = widths.filter(|width| *width <= MAX_FIELD_COLUMNS).max();
    let width = width.unwrap_or(0);
    let mut lines = vec![
        about.to_owned(),
        String::new(),
        format!(
            "Usage: cromosim node {name} [--check-config] [--ros-args [-p NAME:=VALUE]... ...]"
        ),
        String::new(),
        "Parameters [default]:".to_owned(),
    ];
    lines.extend(
        rows.iter()
            .map(|(field, about)| format!("  {field:width$}  {about}")),
    );
    lines.push(String::new());
    lines.push("All of it, with remaps, QoS and environment: --help".to_owned());
    let lines = lines.iter().map(|line| first_columns(line));
    lines.collect::<Vec<_>>().join("\n")
}

/// The line, cut where the screen ends.
fn first_columns(line: &str) -> String {
    if line.chars().count() <= SCREEN_COLUMNS {
        return line.to_owned();
    }
    let kept: String = line.chars().take(SCREEN_COLUMNS - 1).collect();
    format!("{}…", kept.trim_end())
}

fn help<C: NodeConfig>(name: &str, about: &str) -> String {
    let mut text = format!(
        "{about}\n\nUsage: cromosim node {name} [--check-config] [--end-with-stdin] [--ros-args [-p NAME:=VALUE]... [--params-file FILE]... [-r FROM:=TO]... \
         [--log-level LEVEL]]\n\nParameters [default]:\n"
    );
    for (field, default, about) in parameters::<C>() {
        text += &format!("  {field} [{default}]\n      {about}\n");
    }
    text += "  use_sim_time [false]\n      Take the time from /clock.\n  qos_overrides./TOPIC.publisher.depth (or .subscription; depth, reliability, durability, history)\n      Quality of service of a topic.\n\n";
    text +=
        "--end-with-stdin: end when standard input does, as when the process that holds it dies\n";
    text += "Remaps: -r from:=to for topics, -r __node:=NAME, -r __ns:=/NAMESPACE\n";
    text += "Environment: ROS_DOMAIN_ID; ROS_AUTOMATIC_DISCOVERY_RANGE (OFF, LOCALHOST, SUBNET, SYSTEM_DEFAULT; here LOCALHOST unless set); ROS_LOCALHOST_ONLY; ROS_SECURITY_ENABLE, ROS_SECURITY_STRATEGY, ROS_SECURITY_KEYSTORE, ROS_SECURITY_ENCLAVE_OVERRIDE";
    text
}

/// Prints the line `ready` on standard output once every publisher has `subscriptions`
/// subscriptions, or the node ends; whoever started the process may wait for it. Does not block.
pub fn announce_ready(node: &Node, publishers: &[&RawPublisher], subscriptions: i64) {
    let subscriptions = usize::try_from(subscriptions).unwrap_or(0);
    let publishers: Vec<_> = publishers.iter().map(|publisher| publisher.gid()).collect();
    let watched = node.clone();
    let wait = move || {
        let connected = || {
            publishers
                .iter()
                .all(|&gid| watched.matched(gid) >= subscriptions)
        };
        while !watched.shutdown().is_requested() {
            if connected() || watched.wait_for_graph(Duration::from_secs(3600), connected) {
                say_ready();
                return;
            }
        }
    };
    if let Err(error) = std::thread::Builder::new().name("ready".into()).spawn(wait) {
        log::error!("cannot watch the connections: {error}");
    }
}

/// What a node's program says of its end before it exits with code 2; names in it are made printable.
pub fn say_error(error: impl std::fmt::Display) {
    let _ = writeln!(
        std::io::stderr(),
        "error: {}",
        printable(&error.to_string())
    );
}

/// What is done again and again at a rate, in a loop that waits for messages.
#[derive(Debug)]
pub struct Periodic {
    interval: Option<Duration>,
    next: Instant,
}

impl Periodic {
    /// Due at once, and then `rate_hz` times a second; never for a rate of 0, or one that is as
    /// good as 0.
    pub fn new(rate_hz: f64) -> Self {
        let interval = (rate_hz > 0.0)
            .then(|| Duration::try_from_secs_f64(1.0 / rate_hz).ok())
            .flatten();
        Self {
            interval,
            next: Instant::now(),
        }
    }

    /// How long until it is due; `None`: never.
    pub fn left(&self) -> Option<Duration> {
        self.interval
            .map(|_| self.next.saturating_duration_since(Instant::now()))
    }

    /// True once in every interval. What was missed is not made up for.
    pub fn is_due(&mut self) -> bool {
        let (Some(interval), now) = (self.interval, Instant::now()) else {
            return false;
        };
        let due = now >= self.next;
        if due {
            self.next = (self.next + interval).max(now);
        }
        due
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    crate::node_config! {
        /// For the tests.
        pub struct Config {
            /// How often, Hz.
            pub rate_hz: f64 = 100.0,
            /// Begin again
            /// at the end.
            pub r#loop: bool = false,
        }
    }

    fn prepared(arguments: &[&str]) -> Result<Option<Prepared<Config>>, RosError> {
        let arguments: Vec<String> = arguments.iter().map(|&text| text.to_owned()).collect();
        prepare("test", "A node for tests", &arguments, |_| Ok(()))
    }

    #[test]
    fn parameters_reach_the_config_and_unknown_ones_are_refused() {
        let config = prepared(&["--ros-args", "-p", "rate_hz:=50.0", "-p", "loop:=true"])
            .unwrap()
            .unwrap()
            .config;
        assert_eq!(
            config,
            Config {
                rate_hz: 50.0,
                r#loop: true
            }
        );
        assert!(prepared(&["--check-config"]).unwrap().is_none());
        for (arguments, expected) in [
            (vec!["--rate", "5"], "--rate"),
            (
                vec!["--ros-args", "-p", "rate:=5.0"],
                "did you mean 'rate_hz'?",
            ),
        ] {
            let text = prepared(&arguments).err().unwrap().to_string();
            assert!(text.contains(expected), "{text}");
        }
    }

    #[test]
    fn short_help_has_a_line_for_every_parameter_and_fits_a_screen() {
        let about = "long ".repeat(40);
        let text = short_help::<Config>("test", &about);
        let has = |begin: &str| text.lines().filter(|line| line.starts_with(begin)).count();
        assert_eq!(
            (has("  rate_hz [100.0]  "), has("  loop [false]  ")),
            (1, 1)
        );
        assert!(
            text.lines().all(|line| line.chars().count() <= 100) && text.contains("long…\n"),
            "{text}"
        );
    }

    #[test]
    fn help_shows_every_parameter_with_its_default() {
        let text = help::<Config>("test", "A node for tests");
        assert!(
            text.contains("rate_hz [100.0]\n      How often, Hz.\n"),
            "{text}"
        );
        assert!(
            text.contains("loop [false]\n      Begin again at the end.\n"),
            "{text}"
        );
    }
}
