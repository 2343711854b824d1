//! Writing MCAP into anything that takes bytes.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_msgs::RosMessage;
use cromosim_spatial::Stamp;
use mcap::records::MessageHeader;

use crate::cdr;
use crate::error::{BagError, write_error};
use crate::metadata::Information;
use crate::summary::{BagSummary, CountedTopic};
use crate::topic::Topic;
use crate::walk::Attachment;

/// How the messages are packed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// As they are.
    #[default]
    None,
    /// Each chunk by Zstandard, on one thread, so that the bytes do not depend on the machine.
    Zstd,
}

/// Names a topic of one [`StreamWriter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TopicId(usize);

struct Channel {
    id: u16,
    next_sequence: u32,
}

/// Writes a rosbag2 MCAP file into `output`. The bytes depend on nothing but the calls: no clock,
/// no randomness.
///
/// A chunk reaches `output` in one piece, when it is full or on [`Self::flush`]. After an error
/// every further call fails too, and what reached `output` before can be recovered.
pub struct StreamWriter<W: Write + Seek> {
    writer: mcap::Writer<W>,
    label: PathBuf,
    channels: Vec<Channel>,
    by_name: HashMap<String, TopicId>,
    summary: BagSummary,
}

impl<W: Write + Seek> StreamWriter<W> {
    /// Starts a file; `label` is its name in error messages.
    ///
    /// # Errors
    /// [`BagError::Io`].
    pub fn new(output: W, label: &Path, compression: Compression) -> Result<Self, BagError> {
        let options = mcap::WriteOptions::new()
            .profile("ros2")
            .library(concat!("cromosim ", env!("CARGO_PKG_VERSION")))
            .compression(match compression {
                Compression::None => None,
                Compression::Zstd => Some(mcap::Compression::Zstd),
            })
            .compression_threads(0)
            .chunk_size(Some(768 * 1024))
            // Chunks are built in memory and appended: a killed process leaves whole chunks, not
            // one with an empty header.
            .disable_seeking(true);
        let writer = options
            .create(output)
            .map_err(|error| write_error(label, error))?;
        Ok(Self {
            writer,
            label: label.to_owned(),
            channels: Vec::new(),
            by_name: HashMap::new(),
            summary: BagSummary::default(),
        })
    }

    /// Announces a topic; the same topic again gives the same id.
    ///
    /// # Errors
    /// [`BagError::WrongType`] where the name has another type already; [`BagError::Refused`] after
    /// 65535 topics; [`BagError::Io`].
    pub fn add_topic(&mut self, topic: &Topic) -> Result<TopicId, BagError> {
        if let Some(&TopicId(index)) = self.by_name.get(&topic.name) {
            let known = &self.summary.topics[index].topic;
            if known.type_name != topic.type_name {
                return Err(wrong_type(topic, known));
            }
        }
        self.add_channel(topic)
    }

    /// As [`Self::add_topic`], but one name may have several types, as foreign files may.
    pub(crate) fn add_channel(&mut self, topic: &Topic) -> Result<TopicId, BagError> {
        if let Some(index) = self
            .summary
            .topics
            .iter()
            .position(|counted| *counted.topic == *topic)
        {
            return Ok(TopicId(index));
        }
        let schema = if topic.type_name.is_empty() {
            Ok(0)
        } else {
            self.writer
                .add_schema(&topic.type_name, &topic.schema_encoding, &topic.schema)
        };
        let writer = &mut self.writer;
        let id = schema
            .and_then(|schema| {
                writer.add_channel(
                    schema,
                    &topic.name,
                    &topic.message_encoding,
                    &topic.metadata,
                )
            })
            .map_err(|error| write_error(&self.label, error))?;
        let topic_id = TopicId(self.channels.len());
        self.channels.push(Channel {
            id,
            next_sequence: 0,
        });
        self.summary.topics.push(CountedTopic {
            topic: Arc::new(topic.clone()),
            message_count: 0,
        });
        self.by_name.entry(topic.name.clone()).or_insert(topic_id);
        Ok(topic_id)
    }

    /// Writes a message with `stamp` as log time and publish time. A new topic is offered as
    /// [`crate::QosProfile::usual`].
    ///
    /// # Errors
    /// As [`Self::add_topic`] and [`Self::write_payload`]; [`BagError::Encode`].
    pub fn write<M: RosMessage>(
        &mut self,
        topic: &str,
        stamp: Stamp,
        message: &M,
    ) -> Result<(), BagError> {
        let id = match self.by_name.get(topic) {
            Some(&id) if self.summary.topics[id.0].topic.type_name == M::TYPE_NAME => id,
            _ => self.add_topic(&Topic::for_message::<M>(topic))?,
        };
        self.write_payload(id, &payload_of(topic, message)?, stamp, stamp)
    }

    /// Writes a message that is encoded already: `payload` is CDR with its four header bytes.
    ///
    /// # Errors
    /// [`BagError::BeforeEpoch`] for times below zero; [`BagError::Refused`] for an id of another
    /// writer; [`BagError::Io`].
    pub fn write_payload(
        &mut self,
        topic: TopicId,
        payload: &[u8],
        log_time: Stamp,
        publish_time: Stamp,
    ) -> Result<(), BagError> {
        let sequence = self
            .channels
            .get(topic.0)
            .map_or(0, |channel| channel.next_sequence);
        self.write_numbered(topic, sequence, payload, log_time, publish_time)
    }

    /// As [`Self::write_payload`], with a running number of the caller's.
    pub(crate) fn write_numbered(
        &mut self,
        topic: TopicId,
        sequence: u32,
        payload: &[u8],
        log_time: Stamp,
        publish_time: Stamp,
    ) -> Result<(), BagError> {
        let (Some(channel), Some(counted)) = (
            self.channels.get_mut(topic.0),
            self.summary.topics.get_mut(topic.0),
        ) else {
            return Err(BagError::Refused {
                path: self.label.clone(),
                reason: format!("topic id {} belongs to another writer", topic.0),
            });
        };
        let header = MessageHeader {
            channel_id: channel.id,
            sequence,
            log_time: nanos(log_time, &counted.topic.name)?,
            publish_time: nanos(publish_time, &counted.topic.name)?,
        };
        self.writer
            .write_to_known_channel(&header, payload)
            .map_err(|error| write_error(&self.label, error))?;
        channel.next_sequence = sequence.wrapping_add(1);
        counted.message_count += 1;
        self.summary.cover(log_time);
        Ok(())
    }

    /// Attaches a file, such as `placements.yaml`; `time` is written as its time of recording and
    /// of creation.
    ///
    /// # Errors
    /// [`BagError::BeforeEpoch`], [`BagError::Io`].
    pub fn attach(
        &mut self,
        name: &str,
        media_type: &str,
        time: Stamp,
        content: &[u8],
    ) -> Result<(), BagError> {
        let time = nanos(time, name)?;
        let (name, media_type) = (name.to_owned(), media_type.to_owned());
        let attachment = mcap::Attachment {
            log_time: time,
            create_time: time,
            name,
            media_type,
            data: Cow::Borrowed(content),
        };
        self.writer
            .attach(&attachment)
            .map_err(|error| write_error(&self.label, error))
    }

    /// Attaches what another bag has attached.
    pub(crate) fn attach_again(&mut self, attachment: &Attachment) -> Result<(), BagError> {
        let attachment = mcap::Attachment {
            log_time: nanos(attachment.log_time, &attachment.name)?,
            create_time: nanos(attachment.create_time, &attachment.name)?,
            name: attachment.name.clone(),
            media_type: attachment.media_type.clone(),
            data: Cow::Borrowed(&attachment.content),
        };
        self.writer
            .attach(&attachment)
            .map_err(|error| write_error(&self.label, error))
    }

    /// Writes a record of names and values, such as the resolved configuration.
    ///
    /// # Errors
    /// [`BagError::Io`].
    pub fn write_metadata(
        &mut self,
        name: &str,
        values: BTreeMap<String, String>,
    ) -> Result<(), BagError> {
        let record = mcap::records::Metadata {
            name: name.to_owned(),
            metadata: values,
        };
        self.writer
            .write_metadata(&record)
            .map_err(|error| write_error(&self.label, error))
    }

    /// Ends the current chunk and hands everything to `output`, flushed.
    ///
    /// # Errors
    /// [`BagError::Io`].
    pub fn flush(&mut self) -> Result<(), BagError> {
        self.writer
            .flush()
            .map_err(|error| write_error(&self.label, error))
    }

    /// What was written so far.
    pub fn summary(&self) -> &BagSummary {
        &self.summary
    }

    /// Writes rosbag2's record, naming the file `file_name`, and the index; returns `output`,
    /// flushed, and what was written.
    ///
    /// # Errors
    /// [`BagError::Io`].
    pub fn finish(mut self, file_name: &str) -> Result<(W, BagSummary), BagError> {
        let mut summary = BagSummary {
            time_range: self.summary.time_range,
            ..BagSummary::default()
        };
        for counted in &self.summary.topics {
            summary.count(&counted.topic, counted.message_count);
        }
        let information = Information::from_summaries(&[(file_name.to_owned(), &summary)]);
        self.write_metadata(
            "rosbag2",
            BTreeMap::from([("serialized_metadata".to_owned(), information.inner_yaml())]),
        )?;
        self.writer
            .finish()
            .map_err(|error| write_error(&self.label, error))?;
        let mut output = self.writer.into_inner();
        output
            .flush()
            .map_err(crate::error::io_error(&self.label, "write"))?;
        Ok((output, summary))
    }
}

/// What [`StreamWriter::write`] makes of a message before it writes it: for those that encode on
/// several threads.
///
/// # Errors
/// [`BagError::Encode`].
pub fn payload_of<M: RosMessage>(topic: &str, message: &M) -> Result<Vec<u8>, BagError> {
    cdr::encode(message).map_err(|reason| BagError::Encode {
        topic: topic.to_owned(),
        type_name: M::TYPE_NAME,
        reason,
    })
}

/// A time as the file holds it; `whose` is named in the error.
fn nanos(time: Stamp, whose: &str) -> Result<u64, BagError> {
    u64::try_from(time.nanos).map_err(|_| BagError::BeforeEpoch {
        topic: whose.to_owned(),
        nanos: time.nanos,
    })
}

fn wrong_type(topic: &Topic, known: &Topic) -> BagError {
    BagError::WrongType {
        topic: topic.name.clone(),
        expected: known.type_name.clone(),
        found: topic.type_name.clone(),
    }
}
