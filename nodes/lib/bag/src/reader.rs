//! Reading bags.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_msgs::RosMessage;
use cromosim_spatial::Stamp;

use crate::cdr;
use crate::chunk::inner_records;
use crate::contents::{ChunkAt, Contents, LooseMessage, MessageHead};
use crate::error::{BagError, io_error};
use crate::metadata::files_of;
use crate::summary::BagSummary;
use crate::topic::Topic;
use crate::walk::{Attachment, Fields, RecordAt, Walker, op, stamp};

/// A bag opened for reading: an MCAP file, or a rosbag2 directory of them.
#[derive(Debug)]
pub struct BagReader {
    path: PathBuf,
    files: Vec<Contents>,
    summary: BagSummary,
}

/// Which messages to read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Names of topics; all where absent.
    pub topics: Option<Vec<String>>,
    /// The first log time; from the start where absent.
    pub from: Option<Stamp>,
    /// The log time before which to end; to the end where absent.
    pub until: Option<Stamp>,
}

impl Selection {
    /// All messages of one topic.
    pub fn topic(name: &str) -> Self {
        Self {
            topics: Some(vec![name.to_owned()]),
            ..Self::default()
        }
    }

    fn has_time(&self, log_time: u64) -> bool {
        let time = stamp(log_time);
        self.from.is_none_or(|from| time >= from) && self.until.is_none_or(|until| time < until)
    }

    fn has_topic(&self, name: &str) -> bool {
        self.topics
            .as_ref()
            .is_none_or(|topics| topics.iter().any(|topic| topic == name))
    }
}

/// One message of a bag, not yet decoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The topic that it was published on.
    pub topic: Arc<Topic>,
    /// The writer's running number.
    pub sequence: u32,
    /// When it was recorded.
    pub log_time: Stamp,
    /// When it was published.
    pub publish_time: Stamp,
    /// CDR with its four header bytes, for topics whose encoding is `cdr`.
    pub payload: Vec<u8>,
}

impl Message {
    /// The message as `M`.
    ///
    /// # Errors
    /// [`BagError::WrongType`], [`BagError::Decode`].
    pub fn decode<M: RosMessage>(&self) -> Result<M, BagError> {
        if self.topic.type_name != M::TYPE_NAME {
            return Err(wrong_type::<M>(&self.topic));
        }
        cdr::decode(&self.payload).map_err(|reason| BagError::Decode {
            topic: self.topic.name.clone(),
            log_time: self.log_time,
            reason,
        })
    }
}

fn wrong_type<M: RosMessage>(topic: &Topic) -> BagError {
    BagError::WrongType {
        topic: topic.name.clone(),
        expected: M::TYPE_NAME.to_owned(),
        found: topic.type_name.clone(),
    }
}

impl BagReader {
    /// Opens a bag and lists what it holds. Files without an index are read as well; unfinished and
    /// cut ones are not.
    ///
    /// # Errors
    /// [`BagError::Unfinished`] and [`BagError::Corrupt`] with the byte where reading ended,
    /// [`BagError::NotMcap`], [`BagError::NoMetadata`], [`BagError::Metadata`],
    /// [`BagError::Unsupported`], [`BagError::Io`].
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let paths = if path.is_dir() {
            files_of(path)?
        } else {
            vec![path.to_owned()]
        };
        let files = paths
            .iter()
            .map(|file| Contents::read(file))
            .collect::<Result<Vec<_>, _>>()?;
        let mut summary = BagSummary::default();
        files.iter().for_each(|file| summary.add(&file.summary));
        Ok(Self {
            path: path.to_owned(),
            files,
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
        for contents in &mut self.files {
            for (channel, topic) in &mut contents.channels.topics {
                match inside(topic) {
                    Some(seen) => *topic = seen,
                    None => {
                        contents.hidden.insert(*channel);
                    }
                }
            }
        }
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
        self.files.iter().flat_map(|file| &file.attachments)
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
            .flat_map(|file| &file.metadata)
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
            .map(|contents| FileMessages::new(contents, selection))
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
    files: Vec<FileMessages<'a>>,
    failed: bool,
}

impl Iterator for Messages<'_> {
    type Item = Result<Message, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let mut earliest: Option<(u64, usize)> = None;
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
        self.files.get_mut(earliest?.1)?.pop().map(Ok)
    }
}

/// A message read ahead, ordered by log time and then by place in the file.
struct Ahead {
    order: (u64, u64, usize),
    message: Message,
}

impl PartialEq for Ahead {
    fn eq(&self, other: &Self) -> bool {
        self.order == other.order
    }
}
impl Eq for Ahead {}
impl PartialOrd for Ahead {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Ahead {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.order.cmp(&other.order)
    }
}

/// A stretch of the file that is read in one go.
enum Stretch {
    Chunk(ChunkAt),
    Loose(LooseMessage),
}

impl Stretch {
    /// No message in the stretch is earlier.
    fn start_time(&self) -> u64 {
        match self {
            Self::Chunk(chunk) => chunk.start_time,
            Self::Loose(message) => message.log_time,
        }
    }

    fn record(&self) -> RecordAt {
        match self {
            Self::Chunk(chunk) => chunk.record,
            Self::Loose(message) => message.record,
        }
    }
}

/// The messages of one file: stretches are loaded when their time comes.
struct FileMessages<'a> {
    contents: &'a Contents,
    selection: Selection,
    walker: Walker<File>,
    stretches: VecDeque<Stretch>,
    ahead: BinaryHeap<Reverse<Ahead>>,
}

impl<'a> FileMessages<'a> {
    fn new(contents: &'a Contents, selection: &Selection) -> Result<Self, BagError> {
        let path = &contents.path;
        let file = cromosim_spatial::open_file(path).map_err(io_error(path, "open"))?;
        let walker = Walker::new(file)
            .map_err(io_error(path, "read"))?
            .ok_or_else(|| BagError::NotMcap { path: path.clone() })?;
        let outside = |start: u64, end: u64| {
            selection.until.is_some_and(|until| stamp(start) >= until)
                || selection.from.is_some_and(|from| stamp(end) < from)
        };
        let chunks = contents
            .chunks
            .iter()
            .filter(|chunk| !outside(chunk.start_time, chunk.end_time))
            .map(|&chunk| Stretch::Chunk(chunk));
        let loose = contents
            .loose
            .iter()
            .filter(|message| selection.has_time(message.log_time))
            .map(|&message| Stretch::Loose(message));
        let mut stretches: Vec<Stretch> = chunks.chain(loose).collect();
        stretches.sort_by_key(|stretch| (stretch.start_time(), stretch.record().start));
        Ok(Self {
            contents,
            selection: selection.clone(),
            walker,
            stretches: stretches.into(),
            ahead: BinaryHeap::new(),
        })
    }

    /// Log time of the next message, once everything that could come before it is loaded.
    fn peek_time(&mut self) -> Result<Option<u64>, BagError> {
        while let Some(stretch) = self.stretches.front() {
            if self
                .ahead
                .peek()
                .is_some_and(|Reverse(next)| next.order.0 < stretch.start_time())
            {
                break;
            }
            if let Some(stretch) = self.stretches.pop_front() {
                self.load(&stretch)?;
            }
        }
        Ok(self.ahead.peek().map(|Reverse(next)| next.order.0))
    }

    fn pop(&mut self) -> Option<Message> {
        self.ahead.pop().map(|Reverse(next)| next.message)
    }

    fn load(&mut self, stretch: &Stretch) -> Result<(), BagError> {
        let record = stretch.record();
        match *stretch {
            Stretch::Loose(_) => {
                let body = self
                    .walker
                    .read_body(record, u64::MAX)
                    .map_err(io_error(&self.contents.path, "read"))?;
                self.take(&body, record, 0)
            }
            Stretch::Chunk(chunk) => {
                let records = self.contents.unpack(chunk, &mut self.walker)?;
                let messages = inner_records(&records).filter(|inner| inner.opcode == op::MESSAGE);
                messages
                    .enumerate()
                    .try_for_each(|(index, inner)| self.take(inner.body, record, index))
            }
        }
    }

    fn take(&mut self, body: &[u8], record: RecordAt, index: usize) -> Result<(), BagError> {
        let corrupt = |reason: String| BagError::Corrupt {
            path: self.contents.path.clone(),
            at: record.start,
            reason,
        };
        let mut fields = Fields(body);
        let head = MessageHead::take(&mut fields)
            .ok_or_else(|| corrupt("a message without a whole header".to_owned()))?;
        if self.contents.hidden.contains(&head.channel) {
            return Ok(());
        }
        let topic = self.contents.channels.topics.get(&head.channel);
        let topic = topic
            .ok_or_else(|| corrupt(format!("a message of the unknown channel {}", head.channel)))?;
        if self.selection.has_time(head.log_time) && self.selection.has_topic(&topic.name) {
            let message = Message {
                topic: Arc::clone(topic),
                sequence: head.sequence,
                log_time: stamp(head.log_time),
                publish_time: stamp(head.publish_time),
                payload: fields.0.to_vec(),
            };
            self.ahead.push(Reverse(Ahead {
                order: (head.log_time, record.start, index),
                message,
            }));
        }
        Ok(())
    }
}
