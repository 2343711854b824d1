//! One file of a bag, whatever its storage.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use cromosim_spatial::Stamp;

use crate::contents::Contents;
use crate::error::{BagError, io_error};
use crate::mcap_messages::FileMessages;
use crate::message::{Message, Selection};
use crate::ros1::{MAGIC as ROS1_MAGIC, Ros1File, Ros1Messages};
use crate::sqlite::{MAGIC as SQLITE_MAGIC, SqliteFile, SqliteMessages};
use crate::summary::BagSummary;
use crate::topic::Topic;
use crate::walk::Attachment;

/// Whether a file that begins so is a bag: MCAP, SQLite (rosbag2's default until Humble) or ROS 1.
pub fn starts_like_bag(head: &[u8]) -> bool {
    head.starts_with(mcap::MAGIC.get(..5).unwrap_or(mcap::MAGIC))
        || head.starts_with(SQLITE_MAGIC)
        || head.starts_with(ROS1_MAGIC)
}

/// A file by its storage.
#[derive(Debug)]
pub(crate) enum StoredFile {
    Mcap(Contents),
    Sqlite(SqliteFile),
    Ros1(Ros1File),
}

impl StoredFile {
    /// Opens a file and lists what it holds.
    pub(crate) fn open(path: &Path) -> Result<Self, BagError> {
        let mut head = Vec::new();
        cromosim_spatial::open_file(path)
            .map_err(io_error(path, "open"))?
            .take(SQLITE_MAGIC.len() as u64)
            .read_to_end(&mut head)
            .map_err(io_error(path, "read"))?;
        if head.starts_with(SQLITE_MAGIC) {
            Ok(Self::Sqlite(SqliteFile::open(path)?))
        } else if head.starts_with(ROS1_MAGIC) {
            Ok(Self::Ros1(Ros1File::open(path)?))
        } else {
            Ok(Self::Mcap(Contents::read(path)?))
        }
    }

    pub(crate) fn summary(&self) -> &BagSummary {
        match self {
            Self::Mcap(contents) => &contents.summary,
            Self::Sqlite(file) => &file.summary,
            Self::Ros1(file) => &file.summary,
        }
    }

    /// Attachments; MCAP alone has any.
    pub(crate) fn attachments(&self) -> &[Attachment] {
        match self {
            Self::Mcap(contents) => &contents.attachments,
            _ => &[],
        }
    }

    /// Metadata records; MCAP alone has any.
    pub(crate) fn metadata(&self) -> &[(String, BTreeMap<String, String>)] {
        match self {
            Self::Mcap(contents) => &contents.metadata,
            _ => &[],
        }
    }

    /// Renames topics, or hides those that `seen` does not give.
    pub(crate) fn see(&mut self, seen: &dyn Fn(&Topic) -> Option<Arc<Topic>>) {
        match self {
            Self::Mcap(contents) => {
                for (channel, topic) in &mut contents.channels.topics {
                    match seen(topic) {
                        Some(topic_seen) => *topic = topic_seen,
                        None => {
                            contents.hidden.insert(*channel);
                        }
                    }
                }
            }
            Self::Sqlite(file) => file.topics.values_mut().for_each(|topic| {
                *topic = topic.take().and_then(|topic| seen(&topic));
            }),
            Self::Ros1(file) => file.see(seen),
        }
    }

    pub(crate) fn messages(&self, selection: &Selection) -> Result<StoredMessages<'_>, BagError> {
        Ok(match self {
            Self::Mcap(contents) => StoredMessages::Mcap(FileMessages::new(contents, selection)?),
            Self::Sqlite(file) => StoredMessages::Sqlite(SqliteMessages::new(file, selection)?),
            Self::Ros1(file) => StoredMessages::Ros1(Ros1Messages::new(file, selection)?),
        })
    }
}

/// The messages of one file in order of time.
pub(crate) enum StoredMessages<'a> {
    Mcap(FileMessages<'a>),
    Sqlite(SqliteMessages<'a>),
    Ros1(Ros1Messages<'a>),
}

impl StoredMessages<'_> {
    /// Log time of the next message.
    pub(crate) fn peek_time(&mut self) -> Result<Option<Stamp>, BagError> {
        match self {
            Self::Mcap(messages) => messages.peek_time(),
            Self::Sqlite(messages) => Ok(messages.peek_time()),
            Self::Ros1(messages) => messages.peek_time(),
        }
    }

    /// The next message, after a look at its time.
    pub(crate) fn pop(&mut self) -> Result<Option<Message>, BagError> {
        match self {
            Self::Mcap(messages) => Ok(messages.pop()),
            Self::Sqlite(messages) => messages.pop(),
            Self::Ros1(messages) => messages.pop(),
        }
    }
}
