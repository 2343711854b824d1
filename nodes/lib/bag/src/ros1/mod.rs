//! ROS 1's bags (`.bag`, format 2.0), read as if their topics were ROS 2's: types are renamed
//! (`sensor_msgs/Imu` is `sensor_msgs/msg/Imu`), messages become CDR by the definitions in the file.

mod definition;
mod records;
mod to_cdr;

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_msgs::known_type;
use cromosim_spatial::Stamp;

use self::definition::{Definition, Field};
use self::records::{Header, RecordAt, Records, inner_records, op};
use crate::ahead::Ahead;
use crate::chunk::decompress;
use crate::error::{BagError, io_error};
use crate::message::{Message, Selection};
use crate::summary::BagSummary;
use crate::topic::Topic;
use crate::walk::LARGEST_RECORD;

/// How a bag of ROS 1 begins.
pub(crate) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// A topic and how its messages are read.
#[derive(Clone, Debug)]
struct Connection {
    /// None outside the namespace that is looked at.
    topic: Option<Arc<Topic>>,
    /// None where the definition could not be read: messages are given as they are.
    fields: Option<Vec<Field>>,
}

/// A packed run of messages.
#[derive(Clone, Debug)]
struct ChunkAt {
    at: u64,
    data_at: u64,
    data_length: u64,
    compression: String,
    unpacked_length: u64,
    /// Times of the first and the last message; none of an empty chunk.
    times: Option<(Stamp, Stamp)>,
}

/// A `.bag` file.
#[derive(Debug)]
pub(crate) struct Ros1File {
    path: PathBuf,
    connections: BTreeMap<u32, Connection>,
    chunks: Vec<ChunkAt>,
    pub(crate) summary: BagSummary,
}

/// What an index says of a chunk.
struct ChunkInfo {
    times: (Stamp, Stamp),
    /// Messages of each connection.
    counts: Vec<(u32, u32)>,
}

impl Ros1File {
    pub(crate) fn open(path: &Path) -> Result<Self, BagError> {
        let mut file = Self {
            path: path.to_owned(),
            connections: BTreeMap::new(),
            chunks: Vec::new(),
            summary: BagSummary::default(),
        };
        let mut records = file.records(MAGIC.len() as u64)?;
        let mut infos = BTreeMap::new();
        while records.position < records.size {
            let record = records.step().map_err(io_error(path, "read"))?;
            let record =
                record.ok_or_else(|| file.damaged(records.position, "the bag is cut off here"))?;
            file.take(&record, &mut records, &mut infos)?;
        }
        file.summarise(&mut records, &infos)?;
        Ok(file)
    }

    fn records(&self, from: u64) -> Result<Records, BagError> {
        let opened = cromosim_spatial::open_file(&self.path);
        opened
            .and_then(|file| Records::new(file, from))
            .map_err(io_error(&self.path, "open"))
    }

    fn damaged(&self, at: u64, reason: impl Into<String>) -> BagError {
        BagError::Ros1 {
            path: self.path.clone(),
            at,
            reason: reason.into(),
        }
    }

    fn take(
        &mut self,
        record: &RecordAt,
        records: &mut Records,
        infos: &mut BTreeMap<u64, ChunkInfo>,
    ) -> Result<(), BagError> {
        let bad = || self.damaged(record.at, "a record whose header is not well-formed");
        let header = Header::parse(&record.header).ok_or_else(bad)?;
        let mut data = || {
            records
                .read(record.data_at, record.data_length)
                .map_err(io_error(&self.path, "read"))
        };
        match header.op().ok_or_else(bad)? {
            op::BAG
                if header
                    .bytes("encryptor")
                    .is_some_and(|name| !name.is_empty()) =>
            {
                return Err(self.damaged(record.at, "the bag is encrypted"));
            }
            op::CONNECTION => {
                let data = data()?;
                let (id, connection) = read_connection(&header, &data).ok_or_else(bad)?;
                self.connections.entry(id).or_insert(connection);
            }
            op::CHUNK => self.chunks.push(ChunkAt {
                at: record.at,
                data_at: record.data_at,
                data_length: record.data_length,
                compression: header.text("compression").ok_or_else(bad)?,
                unpacked_length: u64::from(header.u32("size").ok_or_else(bad)?),
                times: None,
            }),
            op::CHUNK_INFO => {
                let data = data()?;
                let (at, info) = read_info(&header, &data).ok_or_else(bad)?;
                infos.insert(at, info);
            }
            op::MESSAGE => {
                return Err(self.damaged(record.at, "a message outside of a chunk"));
            }
            _ => {}
        }
        Ok(())
    }

    /// Times and counts: from the index where it knows a chunk, else from its messages.
    fn summarise(
        &mut self,
        records: &mut Records,
        infos: &BTreeMap<u64, ChunkInfo>,
    ) -> Result<(), BagError> {
        let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
        for index in 0..self.chunks.len() {
            let chunk = self.chunks[index].clone();
            let info = infos.get(&chunk.at).filter(|info| {
                let known = |(id, _): &(u32, u32)| self.connections.contains_key(id);
                info.counts.iter().all(known)
            });
            let times = if let Some(info) = info {
                for (id, count) in &info.counts {
                    *counts.entry(*id).or_default() += u64::from(*count);
                }
                (!info.counts.is_empty()).then_some(info.times)
            } else {
                self.scan(&chunk, records, &mut counts)?
            };
            if let Some((first, last)) = times {
                self.summary.cover(first);
                self.summary.cover(last);
            }
            self.chunks[index].times = times;
        }
        for (id, connection) in &self.connections {
            if let Some(topic) = &connection.topic {
                let count = counts.get(id).copied().unwrap_or(0);
                self.summary.count(topic, count);
            }
        }
        Ok(())
    }

    /// Looks at each record of a chunk.
    fn scan(
        &mut self,
        chunk: &ChunkAt,
        records: &mut Records,
        counts: &mut BTreeMap<u32, u64>,
    ) -> Result<Option<(Stamp, Stamp)>, BagError> {
        let unpacked = self.unpack(chunk, records)?;
        let mut times: Option<(Stamp, Stamp)> = None;
        for (header, data) in inner_records(&unpacked) {
            match header.op() {
                Some(op::CONNECTION) => {
                    if let Some((id, connection)) = read_connection(&header, data) {
                        self.connections.entry(id).or_insert(connection);
                    }
                }
                Some(op::MESSAGE) => {
                    if let (Some(id), Some(time)) = (header.u32("conn"), header.time("time")) {
                        *counts.entry(id).or_default() += 1;
                        times = Some(times.map_or((time, time), |(first, last)| {
                            (first.min(time), last.max(time))
                        }));
                    }
                }
                _ => {}
            }
        }
        Ok(times)
    }

    fn unpack(&self, chunk: &ChunkAt, records: &mut Records) -> Result<Vec<u8>, BagError> {
        let packed = records
            .read(chunk.data_at, chunk.data_length)
            .map_err(io_error(&self.path, "read"))?;
        let most = chunk.unpacked_length.min(LARGEST_RECORD);
        let (unpacked, fault) = decompress(&chunk.compression, &packed, most);
        let fault = fault.or_else(|| {
            (unpacked.len() as u64 != chunk.unpacked_length).then(|| {
                format!(
                    "expected a chunk of {} bytes, found {}",
                    chunk.unpacked_length,
                    unpacked.len()
                )
            })
        });
        match fault {
            None => Ok(unpacked),
            Some(fault) => Err(self.damaged(chunk.at, fault)),
        }
    }

    /// Renames topics, or hides those that `seen` does not give.
    pub(crate) fn see(&mut self, seen: &dyn Fn(&Topic) -> Option<Arc<Topic>>) {
        for connection in self.connections.values_mut() {
            connection.topic = connection.topic.take().and_then(|topic| seen(&topic));
        }
    }
}

fn read_connection(header: &Header<'_>, data: &[u8]) -> Option<(u32, Connection)> {
    let details = Header::parse(data)?;
    let topic = header.text("topic").or_else(|| details.text("topic"))?;
    let ros1_type = details.text("type")?;
    let text = details.text("message_definition").unwrap_or_default();
    let name = format!("/{}", topic.trim_start_matches('/'));
    let connection = match definition::parse(&ros1_type, &text) {
        Ok(definition) => Connection {
            topic: Some(Arc::new(as_ros2(&name, &ros1_type, &definition))),
            fields: Some(definition.fields),
        },
        // Listed, and not decoded.
        Err(_) => Connection {
            topic: Some(Arc::new(Topic {
                schema_encoding: "ros1msg".to_owned(),
                message_encoding: "ros1".to_owned(),
                ..Topic::with_schema(&name, &ros1_type, &text)
            })),
            fields: None,
        },
    };
    Some((header.u32("conn")?, connection))
}

fn as_ros2(name: &str, ros1_type: &str, definition: &Definition) -> Topic {
    let type_name = match ros1_type {
        "tf/tfMessage" => "tf2_msgs/msg/TFMessage".to_owned(),
        other => other.replacen('/', "/msg/", 1),
    };
    if known_type(&type_name).is_some() {
        Topic::named(name, &type_name)
    } else {
        Topic::with_schema(name, &type_name, &definition.ros2_text)
    }
}

fn read_info(header: &Header<'_>, mut data: &[u8]) -> Option<(u64, ChunkInfo)> {
    let mut counts = Vec::new();
    while let Some((pair, rest)) = data.split_first_chunk::<8>() {
        let [a, b, c, d, e, f, g, h] = *pair;
        counts.push((
            u32::from_le_bytes([a, b, c, d]),
            u32::from_le_bytes([e, f, g, h]),
        ));
        data = rest;
    }
    let info = ChunkInfo {
        times: (header.time("start_time")?, header.time("end_time")?),
        counts,
    };
    Some((header.u64("chunk_pos")?, info))
}

/// A message's connection and content with its time, the start of its chunk and its number in it.
type MessageAhead = Ahead<(Stamp, u64, usize), (u32, Vec<u8>)>;

/// The messages of a `.bag` file: chunks are loaded when their time comes.
pub(crate) struct Ros1Messages<'a> {
    file: &'a Ros1File,
    selection: Selection,
    records: Records,
    chunks: VecDeque<(Stamp, &'a ChunkAt)>,
    ahead: BinaryHeap<Reverse<MessageAhead>>,
}

impl<'a> Ros1Messages<'a> {
    pub(crate) fn new(file: &'a Ros1File, selection: &Selection) -> Result<Self, BagError> {
        let inside = |chunk: &'a ChunkAt| {
            let (first, last) = chunk.times?;
            let outside = selection.until.is_some_and(|until| first >= until)
                || selection.from.is_some_and(|from| last < from);
            (!outside).then_some((first, chunk))
        };
        let mut chunks: Vec<(Stamp, &ChunkAt)> = file.chunks.iter().filter_map(inside).collect();
        chunks.sort_by_key(|(first, chunk)| (*first, chunk.at));
        Ok(Self {
            file,
            selection: selection.clone(),
            records: file.records(MAGIC.len() as u64)?,
            chunks: chunks.into(),
            ahead: BinaryHeap::new(),
        })
    }

    /// Time of the next message, once everything that could come before it is loaded.
    pub(crate) fn peek_time(&mut self) -> Result<Option<Stamp>, BagError> {
        while let Some(&(first, chunk)) = self.chunks.front() {
            if self
                .ahead
                .peek()
                .is_some_and(|Reverse(next)| next.order.0 < first)
            {
                break;
            }
            self.chunks.pop_front();
            self.load(chunk)?;
        }
        Ok(self.ahead.peek().map(|Reverse(next)| next.order.0))
    }

    fn load(&mut self, chunk: &ChunkAt) -> Result<(), BagError> {
        let unpacked = self.file.unpack(chunk, &mut self.records)?;
        for (index, (header, data)) in inner_records(&unpacked).enumerate() {
            if header.op() != Some(op::MESSAGE) {
                continue;
            }
            let (Some(id), Some(time)) = (header.u32("conn"), header.time("time")) else {
                return Err(self
                    .file
                    .damaged(chunk.at, "a message without a whole header"));
            };
            let Some(connection) = self.file.connections.get(&id) else {
                let reason = format!("a message of the unknown connection {id}");
                return Err(self.file.damaged(chunk.at, reason));
            };
            let wanted = |topic: &Arc<Topic>| self.selection.has_topic(&topic.name);
            if connection.topic.as_ref().is_some_and(wanted) && self.selection.has_time(time) {
                self.ahead.push(Reverse(Ahead {
                    order: (time, chunk.at, index),
                    value: (id, data.to_vec()),
                }));
            }
        }
        Ok(())
    }

    pub(crate) fn pop(&mut self) -> Result<Option<Message>, BagError> {
        let Some(Reverse(next)) = self.ahead.pop() else {
            return Ok(None);
        };
        let (connection, content) = next.value;
        let Some(Connection {
            topic: Some(topic),
            fields,
        }) = self.file.connections.get(&connection)
        else {
            return Ok(None);
        };
        let (time, at, _) = next.order;
        let payload = match fields {
            None => content,
            Some(fields) => to_cdr::to_cdr(fields, &content).map_err(|reason| {
                let name = &topic.name;
                self.file.damaged(
                    at,
                    format!("a message on {name} is not as defined: {reason}"),
                )
            })?,
        };
        Ok(Some(Message {
            topic: Arc::clone(topic),
            sequence: 0,
            log_time: time,
            publish_time: time,
            payload,
        }))
    }
}
