//! What can go wrong with a bag.

use cromosim_spatial::meant;
use std::io;
use std::path::{Path, PathBuf};

use cromosim_spatial::Stamp;
use thiserror::Error;

/// Everything that this crate returns as an error. Each message names the file and the place, and a
/// remedy where there is one.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BagError {
    /// The operating system refused.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// What was attempted.
        action: &'static str,
        /// What it said.
        source: io::Error,
    },
    /// A recording stopped because it could not be written; what was written before is kept.
    #[error("{}: cannot write: {source}; what was recorded before is kept: mend it with `cromosim bag recover {}`", path.display(), path.display())]
    RecordingStopped {
        /// The bag, as the user named it.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// Not a bag at all.
    #[error("{}: not a bag: it starts neither as MCAP nor as SQLite nor as a bag of ROS 1 does", path.display())]
    NotABag {
        /// The file.
        path: PathBuf,
    },
    /// The file ends too early: a recorder was killed, or the file was cut.
    #[error("{}, byte {at} of {size}: the bag is cut off here; mend it with `cromosim bag recover {}`", path.display(), path.display())]
    Unfinished {
        /// The MCAP file.
        path: PathBuf,
        /// Where the first incomplete record starts.
        at: u64,
        /// Length of the file, bytes.
        size: u64,
    },
    /// The file holds what no MCAP writer writes.
    #[error("{}, byte {at}: {reason}; what is whole can be saved with `cromosim bag recover {}`", path.display(), path.display())]
    Corrupt {
        /// The MCAP file.
        path: PathBuf,
        /// Start of the record.
        at: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// A file that `recover` does not know.
    #[error("{}: not an MCAP file, and no others are recovered; `sqlite3 FILE .recover` mends SQLite files, `rosbag reindex` of ROS 1 its own", path.display())]
    NotRecoverable {
        /// The file.
        path: PathBuf,
    },
    /// An SQLite file that is damaged, or no bag.
    #[error("{}: cannot be read as a bag: {reason}", path.display())]
    Database {
        /// The `.db3` file.
        path: PathBuf,
        /// What SQLite said.
        reason: String,
    },
    /// A bag of ROS 1 that is cut or damaged.
    #[error("{}, byte {at}: {reason}; `rosbag reindex` of ROS 1 mends bags that were cut", path.display())]
    Ros1 {
        /// The `.bag` file.
        path: PathBuf,
        /// Start of the record.
        at: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// A bag directory without its table of contents.
    #[error("{}: no metadata.yaml in this directory; where it holds .mcap files, `cromosim bag recover {}` makes it anew; give a .db3 file itself", path.display(), path.display())]
    NoMetadata {
        /// Where `metadata.yaml` should be.
        path: PathBuf,
    },
    /// A `metadata.yaml` that does not say what it must.
    #[error("{}: {reason}", path.display())]
    Metadata {
        /// The MCAP file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A bag of a kind that this crate does not read.
    #[error("{}: {what} is not supported, only MCAP and sqlite3, as they are or compressed by zstd", path.display())]
    Unsupported {
        /// As the user named it.
        path: PathBuf,
        /// What it uses.
        what: String,
    },
    /// No such topic.
    #[error("{}: no topic {topic}; it holds {}{}", path.display(), list(known), meant(topic, known.iter().map(String::as_str)))]
    UnknownTopic {
        /// As the user named it.
        path: PathBuf,
        /// The topic asked for.
        topic: String,
        /// The topics that there are.
        known: Vec<String>,
    },
    /// A topic of another type than asked for, or written before.
    #[error("topic {topic}: expected {expected}, found {found}")]
    WrongType {
        /// Its absolute name.
        topic: String,
        /// The type asked for.
        expected: String,
        /// The type it has.
        found: String,
    },
    /// A message that does not decode.
    #[error("topic {topic}, message at {} ns: {reason}", log_time.nanos)]
    Decode {
        /// Absolute name of its topic.
        topic: String,
        /// When it was logged.
        log_time: Stamp,
        /// What is wrong with it.
        reason: String,
    },
    /// A message that cannot be encoded.
    #[error("topic {topic}: cannot encode {type_name}: {reason}")]
    Encode {
        /// Absolute name of its topic.
        topic: String,
        /// `package/msg/Name`.
        type_name: &'static str,
        /// What the encoder says.
        reason: String,
    },
    /// MCAP holds no time before the epoch.
    #[error("{topic}: time {nanos} ns lies before the epoch, which a bag cannot hold")]
    BeforeEpoch {
        /// The topic or attachment.
        topic: String,
        /// Since the UNIX epoch; negative.
        nanos: i64,
    },
    /// The output is there already.
    #[error("{}: is there already; name another one, or move it away", path.display())]
    Exists {
        /// What was to be written.
        path: PathBuf,
    },
    /// MCAP's own limits (65535 topics) were passed.
    #[error("{}: cannot write: {reason}", path.display())]
    Refused {
        /// As the user named it.
        path: PathBuf,
        /// Which limit was passed.
        reason: String,
    },
}

fn list(names: &[String]) -> String {
    if names.is_empty() {
        "no topics".to_owned()
    } else {
        names.join(", ")
    }
}

/// Makes an [`io::Error`] into a [`BagError::Io`].
pub(crate) fn io_error(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> BagError {
    let path = path.to_owned();
    move |source| BagError::Io {
        path,
        action,
        source,
    }
}

/// What the MCAP writer says, with the operating system's reason in front where there is one.
pub(crate) fn write_error(path: &Path, error: mcap::McapError) -> BagError {
    match error {
        mcap::McapError::Io(source) => BagError::Io {
            path: path.to_owned(),
            action: "write",
            source,
        },
        other => BagError::Refused {
            path: path.to_owned(),
            reason: other.to_string(),
        },
    }
}
