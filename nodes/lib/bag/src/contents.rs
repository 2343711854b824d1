//! What one MCAP file holds, found by walking over it once: it needs no index and trusts none.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::chunk::{ChunkHeader, HEADER_AT_MOST, inner_records, unpack};
use crate::error::{BagError, io_error};
use crate::summary::BagSummary;
use crate::topic::Topic;
use crate::walk::{Attachment, Fields, RecordAt, Step, Walker, op, parse_attachment, stamp};

/// A chunk and the log times that its header claims.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChunkAt {
    pub(crate) record: RecordAt,
    pub(crate) start_time: u64,
    pub(crate) end_time: u64,
}

/// A message outside any chunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LooseMessage {
    pub(crate) record: RecordAt,
    pub(crate) log_time: u64,
}

/// The head of a message record.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MessageHead {
    pub(crate) channel: u16,
    pub(crate) sequence: u32,
    pub(crate) log_time: u64,
    pub(crate) publish_time: u64,
}

impl MessageHead {
    /// Bytes of the head.
    const BYTES: u64 = 22;

    pub(crate) fn take(fields: &mut Fields<'_>) -> Option<Self> {
        Some(Self {
            channel: fields.u16()?,
            sequence: fields.u32()?,
            log_time: fields.u64()?,
            publish_time: fields.u64()?,
        })
    }
}

/// A schema record.
#[derive(Clone, Debug, Default)]
struct Schema {
    type_name: String,
    encoding: String,
    text: Vec<u8>,
}

/// Schemas and channels met so far.
#[derive(Debug, Default)]
pub(crate) struct Channels {
    schemas: BTreeMap<u16, Schema>,
    pub(crate) topics: BTreeMap<u16, Arc<Topic>>,
}

impl Channels {
    /// Takes a schema or channel record; says what is wrong with it.
    pub(crate) fn take(&mut self, opcode: u8, body: &[u8]) -> Result<(), String> {
        let mut fields = Fields(body);
        match opcode {
            op::SCHEMA => {
                let (id, schema) =
                    read_schema(&mut fields).ok_or("a schema that is not well-formed")?;
                self.schemas.insert(id, schema);
            }
            op::CHANNEL => {
                let (id, topic) = self.read_channel(&mut fields)?;
                match self.topics.get(&id) {
                    Some(known) if **known != topic => {
                        return Err(format!("channel {id} is {} and {}", known.name, topic.name));
                    }
                    Some(_) => {}
                    None => {
                        self.topics.insert(id, Arc::new(topic));
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn read_channel(&self, fields: &mut Fields<'_>) -> Result<(u16, Topic), String> {
        let malformed = || "a channel that is not well-formed".to_owned();
        let (id, schema_id) = fields.u16().zip(fields.u16()).ok_or_else(malformed)?;
        let (name, message_encoding) =
            fields.string().zip(fields.string()).ok_or_else(malformed)?;
        let metadata = read_map(fields).ok_or_else(malformed)?;
        let schema = match (schema_id, self.schemas.get(&schema_id)) {
            (0, _) => Schema::default(),
            (_, Some(schema)) => schema.clone(),
            (_, None) => return Err(format!("topic {name} has the unknown schema {schema_id}")),
        };
        let Schema {
            type_name,
            encoding: schema_encoding,
            text: schema,
        } = schema;
        Ok((
            id,
            Topic {
                name,
                type_name,
                schema_encoding,
                schema,
                message_encoding,
                metadata,
            },
        ))
    }
}

fn read_schema(fields: &mut Fields<'_>) -> Option<(u16, Schema)> {
    let id = fields.u16()?;
    let (type_name, encoding) = (fields.string()?, fields.string()?);
    let length = fields.u32()? as usize;
    Some((
        id,
        Schema {
            type_name,
            encoding,
            text: fields.bytes(length)?.to_vec(),
        },
    ))
}

fn read_map(fields: &mut Fields<'_>) -> Option<BTreeMap<String, String>> {
    let length = fields.u32()? as usize;
    let mut inner = Fields(fields.bytes(length)?);
    let mut map = BTreeMap::new();
    while !inner.0.is_empty() {
        map.insert(inner.string()?, inner.string()?);
    }
    Some(map)
}

/// A record of names and values.
pub(crate) fn read_metadata(body: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    let mut fields = Fields(body);
    Some((fields.string()?, read_map(&mut fields)?))
}

/// One MCAP file, walked over.
#[derive(Debug)]
pub(crate) struct Contents {
    pub(crate) path: PathBuf,
    pub(crate) channels: Channels,
    pub(crate) chunks: Vec<ChunkAt>,
    pub(crate) loose: Vec<LooseMessage>,
    pub(crate) attachments: Vec<Attachment>,
    pub(crate) metadata: Vec<(String, BTreeMap<String, String>)>,
    pub(crate) summary: BagSummary,
    /// Channels outside the namespace that is looked at.
    pub(crate) hidden: BTreeSet<u16>,
}

/// Message counts and times as the file's statistics say them.
struct Statistics {
    message_count: u64,
    start: u64,
    end: u64,
    counts: BTreeMap<u16, u64>,
}

fn read_statistics(body: &[u8]) -> Option<Statistics> {
    let mut fields = Fields(body);
    let message_count = fields.u64()?;
    // Counts of schemas, channels, attachments, metadata records and chunks.
    fields.bytes(2 + 4 + 4 + 4 + 4)?;
    let (start, end) = (fields.u64()?, fields.u64()?);
    let length = fields.u32()? as usize;
    let mut inner = Fields(fields.bytes(length)?);
    let mut counts = BTreeMap::new();
    while !inner.0.is_empty() {
        counts.insert(inner.u16()?, inner.u64()?);
    }
    Some(Statistics {
        message_count,
        start,
        end,
        counts,
    })
}

impl Contents {
    /// Walks over a file.
    pub(crate) fn read(path: &Path) -> Result<Self, BagError> {
        let file = cromosim_spatial::open_file(path).map_err(io_error(path, "open"))?;
        let mut walker = Walker::new(file)
            .map_err(io_error(path, "read"))?
            .ok_or_else(|| BagError::NotABag {
                path: path.to_owned(),
            })?;
        let mut contents = Self {
            path: path.to_owned(),
            channels: Channels::default(),
            chunks: Vec::new(),
            loose: Vec::new(),
            attachments: Vec::new(),
            metadata: Vec::new(),
            summary: BagSummary::default(),
            hidden: BTreeSet::new(),
        };
        let mut statistics = None;
        loop {
            match walker.step().map_err(io_error(path, "read"))? {
                Step::Whole(record) => contents.take(record, &mut walker, &mut statistics)?,
                Step::Finished => break,
                Step::Cut(RecordAt { start: at, .. }) | Step::Ragged(at) => {
                    return Err(unfinished(path, at, walker.size()));
                }
                Step::Ended => return Err(unfinished(path, walker.size(), walker.size())),
            }
        }
        contents.summarise(statistics, &mut walker)?;
        Ok(contents)
    }

    fn corrupt(&self, record: RecordAt, reason: impl Into<String>) -> BagError {
        BagError::Corrupt {
            path: self.path.clone(),
            at: record.start,
            reason: reason.into(),
        }
    }

    fn take(
        &mut self,
        record: RecordAt,
        walker: &mut Walker<File>,
        statistics: &mut Option<Statistics>,
    ) -> Result<(), BagError> {
        let path = self.path.clone();
        let mut body = |most| {
            walker
                .read_body(record, most)
                .map_err(io_error(&path, "read"))
        };
        match record.opcode {
            op::SCHEMA | op::CHANNEL => {
                let taken = self.channels.take(record.opcode, &body(u64::MAX)?);
                taken.map_err(|reason| self.corrupt(record, reason))?;
            }
            op::MESSAGE => {
                let head = MessageHead::take(&mut Fields(&body(MessageHead::BYTES)?));
                let head =
                    head.ok_or_else(|| self.corrupt(record, "a message without a whole header"))?;
                self.loose.push(LooseMessage {
                    record,
                    log_time: head.log_time,
                });
            }
            op::CHUNK => {
                let header = ChunkHeader::take(&mut Fields(&body(HEADER_AT_MOST)?));
                let header =
                    header.ok_or_else(|| self.corrupt(record, "a chunk without a whole header"))?;
                self.chunks.push(ChunkAt {
                    record,
                    start_time: header.start_time,
                    end_time: header.end_time,
                });
            }
            op::ATTACHMENT => {
                let attachment = parse_attachment(&body(u64::MAX)?);
                self.attachments.push(attachment.ok_or_else(|| {
                    self.corrupt(record, "an attachment that fails its checksum")
                })?);
            }
            op::METADATA => {
                let metadata = read_metadata(&body(u64::MAX)?);
                self.metadata.push(
                    metadata
                        .ok_or_else(|| self.corrupt(record, "metadata that is not well-formed"))?,
                );
            }
            op::STATISTICS => *statistics = read_statistics(&body(u64::MAX)?),
            _ => {}
        }
        Ok(())
    }

    /// Counts messages: by the file's statistics where it has them for every channel, else by
    /// looking at each message.
    fn summarise(
        &mut self,
        statistics: Option<Statistics>,
        walker: &mut Walker<File>,
    ) -> Result<(), BagError> {
        let statistics = statistics.filter(|known| {
            known
                .counts
                .values()
                .fold(0, |sum: u64, &count| sum.saturating_add(count))
                == known.message_count
                && known
                    .counts
                    .keys()
                    .all(|channel| self.channels.topics.contains_key(channel))
        });
        let mut counts: BTreeMap<u16, u64> =
            self.channels.topics.keys().map(|&id| (id, 0)).collect();
        if let Some(known) = statistics {
            if known.counts.values().any(|&count| count > 0) {
                self.summary.cover(stamp(known.start));
                self.summary.cover(stamp(known.end));
            }
            counts.extend(known.counts);
        } else {
            for message in self.loose.clone() {
                let body = walker
                    .read_body(message.record, MessageHead::BYTES)
                    .map_err(io_error(&self.path, "read"))?;
                self.count(&body, &mut counts);
            }
            for chunk in self.chunks.clone() {
                let records = self.unpack(chunk, walker)?;
                for inner in inner_records(&records) {
                    match inner.opcode {
                        op::MESSAGE => self.count(inner.body, &mut counts),
                        opcode => {
                            let taken = self.channels.take(opcode, inner.body);
                            taken.map_err(|reason| self.corrupt(chunk.record, reason))?;
                        }
                    }
                }
            }
        }
        for (channel, count) in counts {
            if let Some(topic) = self.channels.topics.get(&channel) {
                self.summary.count(topic, count);
            }
        }
        Ok(())
    }

    fn count(&mut self, message: &[u8], counts: &mut BTreeMap<u16, u64>) {
        if let Some(head) = MessageHead::take(&mut Fields(message)) {
            *counts.entry(head.channel).or_default() += 1;
            self.summary.cover(stamp(head.log_time));
        }
    }

    /// The records of a chunk; an error names the chunk.
    pub(crate) fn unpack(
        &self,
        chunk: ChunkAt,
        walker: &mut Walker<File>,
    ) -> Result<Vec<u8>, BagError> {
        let body = walker
            .read_body(chunk.record, u64::MAX)
            .map_err(io_error(&self.path, "read"))?;
        let unpacked = unpack(&body);
        match unpacked.fault {
            None => Ok(unpacked.records),
            Some(reason) => Err(self.corrupt(chunk.record, reason)),
        }
    }
}

fn unfinished(path: &Path, at: u64, size: u64) -> BagError {
    BagError::Unfinished {
        path: path.to_owned(),
        at,
        size,
    }
}
