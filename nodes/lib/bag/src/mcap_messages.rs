//! The messages of an MCAP file in order of time.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::fs::File;
use std::sync::Arc;

use cromosim_spatial::Stamp;

use crate::ahead::Ahead;
use crate::chunk::inner_records;
use crate::contents::{ChunkAt, Contents, LooseMessage, MessageHead};
use crate::error::{BagError, io_error};
use crate::message::{Message, Selection};
use crate::walk::{Fields, RecordAt, Walker, op, stamp};

/// A message with its log time, the start of its stretch and its number in it.
type MessageAhead = Ahead<(u64, u64, usize), Message>;

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
pub(crate) struct FileMessages<'a> {
    contents: &'a Contents,
    selection: Selection,
    walker: Walker<File>,
    stretches: VecDeque<Stretch>,
    ahead: BinaryHeap<Reverse<MessageAhead>>,
}

impl<'a> FileMessages<'a> {
    pub(crate) fn new(contents: &'a Contents, selection: &Selection) -> Result<Self, BagError> {
        let path = &contents.path;
        let file = cromosim_spatial::open_file(path).map_err(io_error(path, "open"))?;
        let walker = Walker::new(file)
            .map_err(io_error(path, "read"))?
            .ok_or_else(|| BagError::NotABag { path: path.clone() })?;
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
            .filter(|message| selection.has_time(stamp(message.log_time)))
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
    pub(crate) fn peek_time(&mut self) -> Result<Option<Stamp>, BagError> {
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
        Ok(self.ahead.peek().map(|Reverse(next)| stamp(next.order.0)))
    }

    pub(crate) fn pop(&mut self) -> Option<Message> {
        self.ahead.pop().map(|Reverse(next)| next.value)
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
        if self.selection.has_time(stamp(head.log_time)) && self.selection.has_topic(&topic.name) {
            let message = Message {
                topic: Arc::clone(topic),
                sequence: head.sequence,
                log_time: stamp(head.log_time),
                publish_time: stamp(head.publish_time),
                payload: fields.0.to_vec(),
            };
            self.ahead.push(Reverse(Ahead {
                order: (head.log_time, record.start, index),
                value: message,
            }));
        }
        Ok(())
    }
}
