//! Reading bags.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_msgs::RosMessage;
use cromosim_spatial::Stamp;
use tempfile::TempPath;

use crate::error::BagError;
use crate::message::{Message, Selection, wrong_type};
use crate::metadata::{Listed, files_of};
use crate::packed::{unpacked, unpacked_file};
use crate::stored::{StoredFile, StoredMessages};
use crate::summary::BagSummary;
use crate::topic::Topic;
use crate::walk::Attachment;

/// A bag opened for reading: an MCAP or SQLite file, a rosbag2 directory of them, or a bag of ROS 1.
#[derive(Debug)]
pub struct BagReader {
    path: PathBuf,
    files: Vec<StoredFile>,
    /// Files that were packed as a whole, as long as they are read.
    _temporary: Vec<TempPath>,
    summary: BagSummary,
}

impl BagReader {
    /// Opens a bag and lists what it holds. Files without an index are read as well; unfinished and
    /// cut ones are not.
    ///
    /// # Errors
    /// [`BagError::Unfinished`] and [`BagError::Corrupt`] with the byte where reading ended,
    /// [`BagError::NotABag`], [`BagError::NoMetadata`], [`BagError::Metadata`],
    /// [`BagError::Unsupported`], [`BagError::Io`].
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let listed = if path.is_dir() {
            files_of(path)?
        } else {
            Listed::alone(path)
        };
        let mut temporary = Vec::new();
        let mut files = Vec::with_capacity(listed.files.len());
        for file in &listed.files {
            files.push(if listed.files_are_packed {
                let whole = unpacked_file(file)?;
                let stored = StoredFile::open(&whole)?;
                temporary.push(whole);
                stored
            } else {
                StoredFile::open(file)?
            });
        }
        let mut summary = BagSummary::default();
        files.iter().for_each(|file| summary.add(file.summary()));
        Ok(Self {
            path: path.to_owned(),
            files,
            _temporary: temporary,
            summary,
        })
    }

    /// The bag as it is seen from within a namespace, such as `/robot1`: its topic `/robot1/imu/wrist/data`
    /// is `/imu/wrist/data`, and what is outside is not there. Times stay those of the whole bag.
    #[must_use]
    pub fn within(mut self, namespace: &str) -> Self {
        let prefix = format!("/{}", namespace.trim_matches('/'));
        let inside = |topic: &Topic| -> Option<Arc<Topic>> {
            let name = topic.name.strip_prefix(&prefix)?;
            name.starts_with('/').then(|| {
                Arc::new(Topic {
                    name: name.to_owned(),
                    ..topic.clone()
                })
            })
        };
        self.files.iter_mut().for_each(|file| file.see(&inside));
        self.summary.topics.retain_mut(|counted| {
            let seen = inside(&counted.topic);
            seen.map(|topic| counted.topic = topic).is_some()
        });
        self
    }

    /// The path that was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Topics, message counts and time range.
    pub fn summary(&self) -> &BagSummary {
        &self.summary
    }

    /// The topic of this name.
    ///
    /// # Errors
    /// [`BagError::UnknownTopic`], with the names that there are.
    pub fn topic(&self, name: &str) -> Result<&Arc<Topic>, BagError> {
        let found = self
            .summary
            .topics
            .iter()
            .find(|counted| counted.topic.name == name);
        found
            .map(|counted| &counted.topic)
            .ok_or_else(|| BagError::UnknownTopic {
                path: self.path.clone(),
                topic: name.to_owned(),
                known: self
                    .summary
                    .topics
                    .iter()
                    .map(|counted| counted.topic.name.clone())
                    .collect(),
            })
    }

    /// The attachments of all files, in their order.
    pub fn attachments(&self) -> impl Iterator<Item = &Attachment> {
        self.files.iter().flat_map(StoredFile::attachments)
    }

    /// The content of the last attachment of this name.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments()
            .filter(|attachment| attachment.name == name)
            .last()
            .map(|attachment| attachment.content.as_slice())
    }

    /// The metadata records of all files, in their order: name and values.
    pub fn metadata_records(&self) -> impl Iterator<Item = (&str, &BTreeMap<String, String>)> {
        self.files
            .iter()
            .flat_map(StoredFile::metadata)
            .map(|(name, values)| (name.as_str(), values))
    }

    /// The last metadata record of this name.
    pub fn metadata(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        self.metadata_records()
            .filter(|(found, _)| *found == name)
            .last()
            .map(|(_, values)| values)
    }

    /// The selected messages in order of log time; those of one time in the order of the file.
    /// Memory: the chunks that overlap in time.
    ///
    /// # Errors
    /// [`BagError::UnknownTopic`]; [`BagError::Io`]. The iterator gives [`BagError::Corrupt`] and
    /// [`BagError::Io`], and then ends.
    pub fn messages(&self, selection: &Selection) -> Result<Messages<'_>, BagError> {
        for name in selection.topics.iter().flatten() {
            self.topic(name)?;
        }
        let files = self
            .files
            .iter()
            .map(|file| file.messages(selection))
            .collect::<Result<_, _>>()?;
        Ok(Messages {
            files,
            failed: false,
        })
    }

    /// All messages of a topic with their log times.
    ///
    /// # Errors
    /// [`BagError::UnknownTopic`], [`BagError::WrongType`], [`BagError::Decode`],
    /// [`BagError::Corrupt`], [`BagError::Io`].
    pub fn read<M: RosMessage>(&self, topic: &str) -> Result<Vec<(Stamp, M)>, BagError> {
        let found = self.topic(topic)?;
        if found.type_name != M::TYPE_NAME {
            return Err(wrong_type::<M>(found));
        }
        self.messages(&Selection::topic(topic))?
            .map(|message| message.and_then(|message| Ok((message.log_time, message.decode()?))))
            .collect()
    }
}

/// Iterates over the messages of a bag: see [`BagReader::messages`].
pub struct Messages<'a> {
    files: Vec<StoredMessages<'a>>,
    failed: bool,
}

impl Iterator for Messages<'_> {
    type Item = Result<Message, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let mut earliest: Option<(Stamp, usize)> = None;
        for (index, file) in self.files.iter_mut().enumerate() {
            match file.peek_time() {
                Err(error) => {
                    self.failed = true;
                    return Some(Err(error));
                }
                Ok(Some(time)) if earliest.is_none_or(|(known, _)| time < known) => {
                    earliest = Some((time, index))
                }
                Ok(_) => {}
            }
        }
        let message = self.files.get_mut(earliest?.1)?.pop().transpose()?;
        let message = message.and_then(unpacked);
        self.failed = message.is_err();
        Some(message)
    }
}
