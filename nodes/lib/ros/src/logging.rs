//! Log lines on the screen as ROS 2 writes them, and on `/rosout`.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::{Arc, Mutex, OnceLock, Weak};

use cromosim_msgs::printable;
use log::{Level, LevelFilter, Log, Metadata, Record};
use ros2_client::{Log as LogMessage, ROSTime};

use crate::clock::system_now;
use crate::core::Core;
use crate::error::RosResult;
use crate::publisher::RawPublisher;
use crate::qos::Qos;
use crate::raw::RawMessage;
use crate::wake::lock;

/// How much is logged: for everything, and for single log targets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLevels {
    default: LevelFilter,
    targets: BTreeMap<String, LevelFilter>,
}

impl Default for LogLevels {
    /// Information, and from DDS errors alone.
    fn default() -> Self {
        let quiet = ["rustdds", "ros2_client", "cdr_encoding", "mio"];
        Self {
            default: LevelFilter::Info,
            targets: quiet
                .map(|target| (target.to_owned(), LevelFilter::Error))
                .into(),
        }
    }
}

impl LogLevels {
    /// `debug`, or `rustdds:=warn` for one log target.
    pub(crate) fn set(&mut self, text: &str) -> Result<(), &'static str> {
        let (target, level) = text
            .split_once(":=")
            .map_or((None, text), |(target, level)| (Some(target), level));
        let level = match level.to_ascii_lowercase().as_str() {
            "debug" => LevelFilter::Debug,
            "info" | "unset" => LevelFilter::Info,
            "warn" => LevelFilter::Warn,
            "error" | "fatal" => LevelFilter::Error,
            _ => return Err("expected debug, info, warn, error or fatal, or NAME:=LEVEL"),
        };
        match target {
            None => self.default = level,
            Some(target) => drop(self.targets.insert(target.to_owned(), level)),
        }
        Ok(())
    }

    fn for_target(&self, target: &str) -> LevelFilter {
        let root = target.split("::").next().unwrap_or(target);
        *self
            .targets
            .get(target)
            .or_else(|| self.targets.get(root))
            .unwrap_or(&self.default)
    }

    /// The most that any target logs.
    fn most_verbose(&self) -> LevelFilter {
        self.targets
            .values()
            .copied()
            .chain([self.default])
            .max()
            .unwrap_or(self.default)
    }
}

struct Logger {
    levels: Mutex<LogLevels>,
    /// Where lines go besides the screen: the process's first node that still lives.
    rosout: Mutex<Option<Weak<Rosout>>>,
}

fn logger() -> &'static Logger {
    static LOGGER: OnceLock<Logger> = OnceLock::new();
    LOGGER.get_or_init(|| Logger {
        levels: Mutex::default(),
        rosout: Mutex::default(),
    })
}

/// Sends the lines of the `log` crate to standard error, and to `/rosout` once a node runs. Does
/// nothing where the program has another logger already. May be called again, with other levels.
pub fn init_logging(levels: &LogLevels) {
    *lock(&logger().levels) = levels.clone();
    if log::set_logger(logger()).is_ok() || std::ptr::addr_eq(log::logger(), logger()) {
        log::set_max_level(levels.most_verbose());
    }
}

/// As ROS 2 writes it. Names in the text may be other nodes'.
fn line(level: Level, now: i64, name: &str, text: &str) -> String {
    let (seconds, nanos) = (now / 1_000_000_000, now % 1_000_000_000);
    let text = printable(text);
    format!("[{level}] [{seconds}.{nanos:09}] [{name}]: {text}")
}

impl Log for Logger {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= lock(&self.levels).for_target(metadata.target())
    }

    fn log(&self, record: &Record<'_>) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let rosout = lock(&self.rosout).as_ref().and_then(Weak::upgrade);
        let name = rosout
            .as_ref()
            .map_or_else(|| record.target().to_owned(), |rosout| rosout.node.clone());
        let now = system_now().nanos;
        let level = record.level();
        // A node works on where nobody reads its log.
        let text = line(level, now, &name, &record.args().to_string());
        let _ = writeln!(std::io::stderr().lock(), "{text}");
        // What DDS says about sending must not be sent by DDS.
        let of_dds = ["rustdds", "ros2_client"]
            .iter()
            .any(|target| record.target().starts_with(target));
        if let Some(rosout) = rosout.filter(|_| !of_dds) {
            rosout.publish(record, now);
        }
    }

    fn flush(&self) {}
}

/// A node's publisher of `/rosout`. Ours, since ros2-client's own keeps only the last line, and
/// loses the others of a burst.
pub(crate) struct Rosout {
    publisher: RawPublisher,
    node: String,
}

impl Rosout {
    pub(crate) fn start(core: &Arc<Core>) -> RosResult<Arc<Self>> {
        let qos = Qos::reliable().depth(1000).transient_local();
        let publisher = RawPublisher::new(core, "/rosout".into(), "rcl_interfaces/msg/Log", qos)?;
        let rosout = Arc::new(Self {
            publisher,
            node: core
                .name
                .to_string()
                .trim_start_matches('/')
                .replace('/', "."),
        });
        let mut current = lock(&logger().rosout);
        if current.as_ref().and_then(Weak::upgrade).is_none() {
            *current = Some(Arc::downgrade(&rosout));
        }
        Ok(rosout)
    }

    fn publish(&self, record: &Record<'_>, now: i64) {
        let level = match record.level() {
            Level::Error => LogMessage::ERROR,
            Level::Warn => LogMessage::WARN,
            Level::Info => LogMessage::INFO,
            Level::Debug | Level::Trace => LogMessage::DEBUG,
        };
        let message = LogMessage {
            stamp: ROSTime::from_nanos(now).into(),
            level,
            name: self.node.clone(),
            msg: record.args().to_string(),
            file: record.file().unwrap_or_default().to_owned(),
            function: String::new(),
            line: record.line().unwrap_or_default(),
        };
        // Nowhere to tell that a log line was lost: it stands on the screen.
        let _ = RawMessage::encode(&message).map(|raw| self.publisher.publish(raw));
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn names_in_a_line_cannot_steer_the_terminal() {
        let hostile = "shows /imu\u{1b}[2J\n[ERROR] [0.0] [recorder]: stopped";
        assert_eq!(
            line(Level::Info, 1_500_000_000, "viewer", hostile),
            r"[INFO] [1.500000000] [viewer]: shows /imu\u{1b}[2J\n[ERROR] [0.0] [recorder]: stopped"
        );
    }

    #[test]
    fn levels_are_for_all_or_for_a_target() {
        let mut levels = LogLevels::default();
        assert_eq!(levels.for_target("cromosim_ros::node"), LevelFilter::Info);
        assert_eq!(
            levels.for_target("rustdds::rtps::reader"),
            LevelFilter::Error
        );
        levels.set("debug").unwrap();
        levels.set("rustdds:=WARN").unwrap();
        assert_eq!(levels.for_target("cromosim_ros::node"), LevelFilter::Debug);
        assert_eq!(
            levels.for_target("rustdds::rtps::reader"),
            LevelFilter::Warn
        );
        assert_eq!(levels.most_verbose(), LevelFilter::Debug);
        assert!(levels.set("loud").is_err());
    }
}
