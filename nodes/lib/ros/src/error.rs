//! What can go wrong.

use std::path::PathBuf;
use std::time::Duration;

/// Every error of this crate. The text is one line and names the place and, where there is one, the
/// remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RosError {
    /// The ROS part of the command line is wrong.
    #[error("{place}: {problem}")]
    Argument {
        /// The argument as it was typed.
        place: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A parameter file cannot be read or does not have ROS 2's layout.
    #[error("{}{}: {problem}", path.display(), line.map(|line| format!(", line {line}")).unwrap_or_default())]
    ParamsFile {
        /// As the command line names it.
        path: PathBuf,
        /// The line, counted from 1, where known.
        line: Option<usize>,
        /// What is wrong.
        problem: String,
    },
    /// A parameter that the node does not have.
    #[error("{place}: unknown parameter '{name}'{}", nearest.as_ref().map(|n| format!(", did you mean '{n}'?")).unwrap_or_default())]
    UnknownParameter {
        /// File and line, or the argument.
        place: String,
        /// The name given.
        name: String,
        /// The declared name that looks most like it.
        nearest: Option<String>,
    },
    /// A value that the parameter does not admit.
    #[error("{place}: parameter '{name}': expected {expected}, found {found}")]
    ParameterValue {
        /// File and line, or the argument.
        place: String,
        /// Its full name, with dots.
        name: String,
        /// The type, or the bounds.
        expected: String,
        /// What was given.
        found: String,
    },
    /// A parameter that cannot change any more.
    #[error("{place}: parameter '{name}' is read-only; give it at the start")]
    ReadOnly {
        /// What asked for the change: a service, or the program.
        place: String,
        /// Its full name, with dots.
        name: String,
    },
    /// The parameters do not make a valid configuration.
    #[error("parameters: {problem}")]
    Config {
        /// What serde says, with the path of the field.
        problem: String,
    },
    /// An environment variable has no valid value.
    #[error("environment variable {variable}={value}: expected {expected}")]
    Environment {
        /// As the shell knows it, such as `ROS_DOMAIN_ID`.
        variable: &'static str,
        /// As it is set.
        value: String,
        /// What it may be.
        expected: &'static str,
    },
    /// Messages must be secured and cannot be.
    #[error("ROS_SECURITY_ENABLE=true with ROS_SECURITY_STRATEGY=Enforce: {problem}")]
    Security {
        /// What is missing.
        problem: String,
    },
    /// A name of a node, topic, service or type that ROS 2 does not allow.
    #[error("name '{name}': {problem}")]
    Name {
        /// As it was given.
        name: String,
        /// The rule it breaks.
        problem: String,
    },
    /// DDS refused: no port is free, say, or no network interface can be used.
    #[error("{doing}: {problem}")]
    Dds {
        /// What was being done.
        doing: String,
        /// What DDS says.
        problem: String,
    },
    /// A reliable subscription holds the publisher back and the send window stayed full: the
    /// message was not sent.
    #[error("topic {topic}: a reliable subscription does not keep up, message not sent")]
    WindowFull {
        /// Absolute, after remapping.
        topic: String,
    },
    /// Bytes that are not this message.
    #[error("{place}: cannot {action} {type_name}: {problem}")]
    Encoding {
        /// Topic or service.
        place: String,
        /// `encode` or `decode`.
        action: &'static str,
        /// The message type.
        type_name: String,
        /// What the encoder says.
        problem: String,
    },
    /// No answer came in time.
    #[error("service {service}: no answer within {waited:?}")]
    ServiceTimeout {
        /// Absolute, after remapping.
        service: String,
        /// How long was waited.
        waited: Duration,
    },
    /// The process is ending.
    #[error("{doing}: interrupted, the process is shutting down")]
    Interrupted {
        /// What was being done.
        doing: String,
    },
}

/// `Result` with [`RosError`].
pub type RosResult<T> = Result<T, RosError>;

pub(crate) fn dds(doing: impl Into<String>, problem: impl std::fmt::Display) -> RosError {
    RosError::Dds {
        doing: doing.into(),
        problem: problem.to_string(),
    }
}
