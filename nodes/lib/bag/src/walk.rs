//! Walking over the records of an MCAP file: where each starts, what kind it is, how long it is.

use std::io::{self, Read, Seek, SeekFrom};

use cromosim_spatial::Stamp;

/// Record kinds of the MCAP specification.
pub(crate) mod op {
    pub(crate) const HEADER: u8 = 0x01;
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const MESSAGE_INDEX: u8 = 0x07;
    pub(crate) const CHUNK_INDEX: u8 = 0x08;
    pub(crate) const ATTACHMENT: u8 = 0x09;
    pub(crate) const ATTACHMENT_INDEX: u8 = 0x0a;
    pub(crate) const STATISTICS: u8 = 0x0b;
    pub(crate) const METADATA: u8 = 0x0c;
    pub(crate) const METADATA_INDEX: u8 = 0x0d;
    pub(crate) const SUMMARY_OFFSET: u8 = 0x0e;
    pub(crate) const DATA_END: u8 = 0x0f;
    /// From here on kinds are anybody's own.
    pub(crate) const PRIVATE: u8 = 0x80;
}

/// Bytes before a record's body: its kind and its length.
pub(crate) const HEADER_BYTES: u64 = 9;

/// No record body longer than this is read into memory, nor a chunk that claims to unpack to more.
pub(crate) const LARGEST_RECORD: u64 = 1 << 30;

/// One record of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RecordAt {
    /// Its kind: one of [`op`].
    pub(crate) opcode: u8,
    /// Where it starts in the file.
    pub(crate) start: u64,
    /// Bytes in its body.
    pub(crate) length: u64,
}

impl RecordAt {
    /// A record's first nine bytes, or more, that stand at `start`.
    pub(crate) fn parse(header: &[u8], start: u64) -> Self {
        let mut length = [0; 8];
        length.copy_from_slice(&header[1..HEADER_BYTES as usize]);
        Self {
            opcode: header[0],
            start,
            length: u64::from_le_bytes(length),
        }
    }

    pub(crate) fn body(self) -> u64 {
        self.start.saturating_add(HEADER_BYTES)
    }

    /// Where the next record starts.
    pub(crate) fn end(self) -> u64 {
        self.body().saturating_add(self.length)
    }
}

/// What the walker met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// A record that lies in the file from end to end.
    Whole(RecordAt),
    /// A record that is longer than the file; its claimed length may be nonsense.
    Cut(RecordAt),
    /// Fewer bytes than a record's header needs, from here on.
    Ragged(u64),
    /// The magic bytes at the end of a finished file.
    Finished,
    /// The file ended between two records without being finished.
    Ended,
}

/// Goes from record to record, reading the headers alone.
pub(crate) struct Walker<R> {
    input: io::BufReader<R>,
    /// Where the next record starts.
    position: u64,
    /// Where `input` stands.
    cursor: u64,
    size: u64,
    footer_seen: bool,
}

impl<R: Read + Seek> Walker<R> {
    /// Starts at the first record; `None` where the file does not start with the magic bytes.
    pub(crate) fn new(mut input: R) -> io::Result<Option<Self>> {
        let size = input.seek(SeekFrom::End(0))?;
        input.seek(SeekFrom::Start(0))?;
        let mut input = io::BufReader::with_capacity(16 * 1024, input);
        let mut magic = [0; mcap::MAGIC.len()];
        if size < magic.len() as u64 {
            return Ok(None);
        }
        input.read_exact(&mut magic)?;
        if magic != mcap::MAGIC {
            return Ok(None);
        }
        Ok(Some(Self {
            input,
            position: magic.len() as u64,
            cursor: magic.len() as u64,
            size,
            footer_seen: false,
        }))
    }

    /// Bytes in the file.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// The next record.
    pub(crate) fn step(&mut self) -> io::Result<Step> {
        let start = self.position;
        let left = self.size - start;
        if self.footer_seen && left >= mcap::MAGIC.len() as u64 {
            let mut magic = [0; mcap::MAGIC.len()];
            self.read_at(start, &mut magic)?;
            return Ok(if magic == mcap::MAGIC {
                Step::Finished
            } else {
                Step::Ragged(start)
            });
        }
        if left == 0 {
            return Ok(Step::Ended);
        }
        if left < HEADER_BYTES {
            return Ok(Step::Ragged(start));
        }
        let mut header = [0; HEADER_BYTES as usize];
        self.read_at(start, &mut header)?;
        let record = RecordAt::parse(&header, start);
        if record.end() > self.size {
            return Ok(Step::Cut(record));
        }
        self.footer_seen = record.opcode == op::FOOTER;
        self.position = record.end();
        Ok(Step::Whole(record))
    }

    /// Up to `most` bytes of a record's body, fewer only where the file ends.
    pub(crate) fn read_body(&mut self, record: RecordAt, most: u64) -> io::Result<Vec<u8>> {
        let in_file = self.size.saturating_sub(record.body());
        let length = record.length.min(most).min(in_file);
        if length > LARGEST_RECORD {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                format!("a record of {length} bytes; at most {LARGEST_RECORD} are read"),
            ));
        }
        let mut body = vec![0; length as usize];
        self.read_at(record.body(), &mut body)?;
        Ok(body)
    }

    /// The header that stands at `at`, which lies in the file.
    pub(crate) fn record_at(&mut self, at: u64) -> io::Result<RecordAt> {
        let mut header = [0; HEADER_BYTES as usize];
        self.read_at(at, &mut header)?;
        Ok(RecordAt::parse(&header, at))
    }

    /// Bytes that lie in the file.
    pub(crate) fn read_range(&mut self, at: u64, length: u64) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; length as usize];
        self.read_at(at, &mut bytes)?;
        Ok(bytes)
    }

    /// Goes on at a record that begins at `at`.
    pub(crate) fn go_to(&mut self, at: u64) {
        self.position = at;
        self.footer_seen = false;
    }

    fn read_at(&mut self, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        // Relative moves keep the buffer where the target lies in it.
        self.input.seek_relative(at as i64 - self.cursor as i64)?;
        self.input.read_exact(bytes)?;
        self.cursor = at + bytes.len() as u64;
        Ok(())
    }
}

/// Reads the fields of a record one after the other; `None` where it ends too early.
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(count)?;
        self.0 = tail;
        Some(head)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.bytes(2)?.try_into().ok().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.bytes(4)?.try_into().ok().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.bytes(8)?.try_into().ok().map(u64::from_le_bytes)
    }

    pub(crate) fn string(&mut self) -> Option<String> {
        let length = self.u32()? as usize;
        String::from_utf8(self.bytes(length)?.to_vec()).ok()
    }
}

/// A file inside the bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Its name, such as `placements.yaml`.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// When it was recorded.
    pub log_time: Stamp,
    /// When it was made.
    pub create_time: Stamp,
    /// Its bytes, as they were attached.
    pub content: Vec<u8>,
}

/// An attachment's record; `None` where it is not well-formed or fails its checksum.
pub(crate) fn parse_attachment(body: &[u8]) -> Option<Attachment> {
    let mut fields = Fields(body);
    let (log_time, create_time) = (fields.u64()?, fields.u64()?);
    let (name, media_type) = (fields.string()?, fields.string()?);
    let length = usize::try_from(fields.u64()?).ok()?;
    let content = fields.bytes(length)?.to_vec();
    let summed = body.len() - fields.0.len();
    let sum = fields.u32()?;
    if sum != 0 && sum != crc32fast::hash(&body[..summed]) {
        return None;
    }
    Some(Attachment {
        name,
        media_type,
        log_time: stamp(log_time),
        create_time: stamp(create_time),
        content,
    })
}

/// A time of the file; what 63 bits do not hold (after the year 2262) saturates.
pub(crate) fn stamp(nanos: u64) -> Stamp {
    Stamp::from_nanos(i64::try_from(nanos).unwrap_or(i64::MAX))
}
