//! Finding the way again in a damaged file: where the next sound record begins, and what the index
//! at the end of the file says of what is missing.

use std::io::{self, Read, Seek};

use cromosim_spatial::Stamp;

use crate::chunk::{ChunkHeader, HEADER_AT_MOST, unpack};
use crate::contents::Channels;
use crate::walk::{
    Fields, HEADER_BYTES, LARGEST_RECORD, RecordAt, Walker, op, parse_attachment, stamp,
};

/// How many records in a row must look sound where none of them carries a checksum.
const IN_A_ROW: usize = 4;
/// Bytes looked at in one piece.
const WINDOW: u64 = 1 << 20;
/// A file whose content imitates chunks is not unpacked more often than so many times its size.
const CHECKED_AT_MOST: u64 = 8;

/// What a record's first nine bytes say, where it can be one.
fn plausible(opcode: u8, length: u64) -> bool {
    let least = match opcode {
        op::HEADER | op::METADATA => 8,
        op::FOOTER => 20,
        op::SCHEMA => 14,
        op::CHANNEL => 16,
        op::MESSAGE => 22,
        op::CHUNK => 40,
        op::MESSAGE_INDEX => 6,
        op::CHUNK_INDEX => 68,
        op::ATTACHMENT => 36,
        op::STATISTICS => 46,
        op::ATTACHMENT_INDEX => 48,
        op::METADATA_INDEX => 20,
        op::SUMMARY_OFFSET => 17,
        op::DATA_END => 4,
        _ => return false,
    };
    length >= least && length <= LARGEST_RECORD
}

/// The length of a chunk's body by its own header: that of the record may be damaged.
pub(crate) fn chunk_length(body: &[u8]) -> Option<u64> {
    let mut fields = Fields(body);
    let header = ChunkHeader::take(&mut fields)?;
    let head = (body.len() - fields.0.len()) as u64;
    let known = matches!(header.compression.as_str(), "" | "zstd" | "lz4");
    (known && header.start_time <= header.end_time)
        .then(|| head.checked_add(header.compressed_size))
        .flatten()
}

/// The search for the next sound record.
pub(crate) struct Search {
    /// Whether records outside chunks hold the messages: a file is packed one way or the other.
    pub(crate) loose_messages: bool,
    checked: u64,
}

impl Search {
    pub(crate) fn new(loose_messages: bool) -> Self {
        Self {
            loose_messages,
            checked: 0,
        }
    }

    /// Whether a record can begin at `at`, or the file end there.
    pub(crate) fn continues<R: Read + Seek>(
        &self,
        walker: &mut Walker<R>,
        at: u64,
    ) -> io::Result<bool> {
        let left = walker.size() - at;
        if left < HEADER_BYTES {
            // The magic bytes, or a file that was cut.
            return Ok(true);
        }
        let record = walker.record_at(at)?;
        Ok(plausible(record.opcode, record.length) || record.opcode >= op::PRIVATE)
    }

    /// Where the next sound record at or after `from` begins.
    pub(crate) fn next_sound<R: Read + Seek>(
        &mut self,
        walker: &mut Walker<R>,
        from: u64,
    ) -> io::Result<Option<u64>> {
        let size = walker.size();
        let mut window_at = from;
        while window_at + HEADER_BYTES <= size {
            let length = (WINDOW + HEADER_BYTES - 1).min(size - window_at);
            let window = walker.read_range(window_at, length)?;
            for (index, header) in window.windows(HEADER_BYTES as usize).enumerate() {
                let record = RecordAt::parse(header, window_at + index as u64);
                if plausible(record.opcode, record.length)
                    && record.end() <= size
                    && self.is_sound(walker, record)?
                {
                    return Ok(Some(record.start));
                }
            }
            window_at += WINDOW;
        }
        Ok(None)
    }

    fn is_sound<R: Read + Seek>(
        &mut self,
        walker: &mut Walker<R>,
        record: RecordAt,
    ) -> io::Result<bool> {
        match record.opcode {
            op::CHUNK => {
                let head = walker.read_body(record, HEADER_AT_MOST)?;
                if chunk_length(&head) != Some(record.length) || !self.may_check(walker, record) {
                    return Ok(false);
                }
                let body = walker.read_body(record, u64::MAX)?;
                Ok(unpack(&body).fault.is_none())
            }
            op::ATTACHMENT => {
                if !self.may_check(walker, record) {
                    return Ok(false);
                }
                let body = walker.read_body(record, u64::MAX)?;
                Ok(parse_attachment(&body).is_some())
            }
            op::METADATA | op::DATA_END => self.is_one_of_a_row(walker, record),
            // Inside a damaged chunk there are such records, too.
            op::SCHEMA | op::CHANNEL | op::MESSAGE if self.loose_messages => {
                self.is_one_of_a_row(walker, record)
            }
            _ => Ok(false),
        }
    }

    fn may_check<R: Read + Seek>(&mut self, walker: &Walker<R>, record: RecordAt) -> bool {
        self.checked = self.checked.saturating_add(record.length);
        self.checked <= walker.size().saturating_mul(CHECKED_AT_MOST)
    }

    /// Whether several records in a row begin at `at`, or the file ends there.
    pub(crate) fn row_begins<R: Read + Seek>(
        &self,
        walker: &mut Walker<R>,
        at: u64,
    ) -> io::Result<bool> {
        if !self.continues(walker, at)? {
            return Ok(false);
        }
        if walker.size() - at < HEADER_BYTES {
            return Ok(true);
        }
        let first = walker.record_at(at)?;
        self.is_one_of_a_row(walker, first)
    }

    fn is_one_of_a_row<R: Read + Seek>(
        &self,
        walker: &mut Walker<R>,
        first: RecordAt,
    ) -> io::Result<bool> {
        let mut record = first;
        for _ in 1..IN_A_ROW {
            if record.end() > walker.size() || !self.continues(walker, record.end())? {
                return Ok(false);
            }
            if walker.size() - record.end() < HEADER_BYTES {
                return Ok(true);
            }
            record = walker.record_at(record.end())?;
        }
        Ok(true)
    }
}

/// What the index at a file's end says of its data, as far as it can be read.
#[derive(Debug, Default)]
pub(crate) struct Index {
    /// How many messages the file held.
    pub(crate) messages: Option<u64>,
    /// Start and times of each chunk.
    chunks: Vec<(u64, [Stamp; 2])>,
}

impl Index {
    /// Reads it, and the schemas and channels that it repeats.
    pub(crate) fn read<R: Read + Seek>(
        walker: &mut Walker<R>,
        channels: &mut Channels,
    ) -> io::Result<Self> {
        let mut index = Self::default();
        let Some(mut at) = summary_start(walker)? else {
            return Ok(index);
        };
        while walker.size() - at >= HEADER_BYTES {
            let record = walker.record_at(at)?;
            if !plausible(record.opcode, record.length)
                || record.opcode == op::FOOTER
                || record.end() > walker.size()
            {
                break;
            }
            let body = walker.read_body(record, u64::MAX)?;
            match record.opcode {
                // What is wrong with it is said when the data are taken over.
                op::SCHEMA | op::CHANNEL => drop(channels.take(record.opcode, &body)),
                op::STATISTICS => index.messages = Fields(&body).u64(),
                op::CHUNK_INDEX => {
                    let mut fields = Fields(&body);
                    if let (Some(from), Some(to), Some(start)) =
                        (fields.u64(), fields.u64(), fields.u64())
                    {
                        index.chunks.push((start, [from, to].map(stamp)));
                    }
                }
                _ => {}
            }
            at = record.end();
        }
        Ok(index)
    }

    /// When the chunks were recorded that begin in a part of the file.
    pub(crate) fn span(&self, part: std::ops::Range<u64>) -> Option<[Stamp; 2]> {
        let times = || {
            let inside = self.chunks.iter().filter(|(start, _)| part.contains(start));
            inside.map(|(_, times)| *times)
        };
        let first = times().map(|[from, _]| from).min()?;
        Some([first, times().map(|[_, to]| to).max()?])
    }
}

/// Where the summary begins, by the footer of a finished file.
fn summary_start<R: Read + Seek>(walker: &mut Walker<R>) -> io::Result<Option<u64>> {
    const FOOTER_BODY: u64 = 20;
    let tail = HEADER_BYTES + FOOTER_BODY + mcap::MAGIC.len() as u64;
    let Some(at) = walker.size().checked_sub(tail) else {
        return Ok(None);
    };
    let bytes = walker.read_range(at, tail)?;
    let footer = RecordAt::parse(&bytes, at);
    if footer.opcode != op::FOOTER || footer.length != FOOTER_BODY || !bytes.ends_with(mcap::MAGIC)
    {
        return Ok(None);
    }
    let start = Fields(&bytes[HEADER_BYTES as usize..]).u64();
    Ok(start.filter(|&start| start > 0 && start < at))
}
