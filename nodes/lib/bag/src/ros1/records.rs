//! Records of ROS 1's bag format 2.0: a header of named fields, then data, each behind its length.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

use cromosim_spatial::Stamp;

use crate::walk::LARGEST_RECORD;

/// Kinds of records.
pub(crate) mod op {
    pub(crate) const MESSAGE: u8 = 0x02;
    pub(crate) const BAG: u8 = 0x03;
    pub(crate) const CHUNK: u8 = 0x05;
    pub(crate) const CHUNK_INFO: u8 = 0x06;
    pub(crate) const CONNECTION: u8 = 0x07;
}

/// The named fields of a record's header.
#[derive(Clone, Debug, Default)]
pub(crate) struct Header<'a>(Vec<(&'a [u8], &'a [u8])>);

impl<'a> Header<'a> {
    /// `None` where a field is cut or has no name.
    pub(crate) fn parse(mut bytes: &'a [u8]) -> Option<Self> {
        let mut fields = Vec::new();
        while !bytes.is_empty() {
            let field = take_counted(&mut bytes)?;
            let equals = field.iter().position(|byte| *byte == b'=')?;
            fields.push((&field[..equals], &field[equals + 1..]));
        }
        Some(Self(fields))
    }

    pub(crate) fn bytes(&self, name: &str) -> Option<&'a [u8]> {
        let found = self.0.iter().find(|(own, _)| *own == name.as_bytes());
        found.map(|(_, value)| *value)
    }

    pub(crate) fn text(&self, name: &str) -> Option<String> {
        self.bytes(name)
            .map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }

    pub(crate) fn op(&self) -> Option<u8> {
        match self.bytes("op")? {
            [op] => Some(*op),
            _ => None,
        }
    }

    pub(crate) fn u32(&self, name: &str) -> Option<u32> {
        self.bytes(name)?.try_into().ok().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&self, name: &str) -> Option<u64> {
        self.bytes(name)?.try_into().ok().map(u64::from_le_bytes)
    }

    /// Seconds and nanoseconds of 32 bits each.
    pub(crate) fn time(&self, name: &str) -> Option<Stamp> {
        let both = self.u64(name)?;
        let (seconds, nanos) = (both & 0xFFFF_FFFF, both >> 32);
        Some(Stamp {
            nanos: (seconds * 1_000_000_000 + nanos).cast_signed(),
        })
    }
}

/// Bytes behind their count.
pub(crate) fn take_counted<'a>(bytes: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (count, rest) = bytes.split_first_chunk()?;
    let (taken, rest) = rest.split_at_checked(u32::from_le_bytes(*count) as usize)?;
    *bytes = rest;
    Some(taken)
}

/// Where a record's data lie, and its header's bytes.
#[derive(Clone, Debug)]
pub(crate) struct RecordAt {
    pub(crate) at: u64,
    pub(crate) header: Vec<u8>,
    pub(crate) data_at: u64,
    pub(crate) data_length: u64,
}

/// The records of a file, data skipped.
#[derive(Debug)]
pub(crate) struct Records {
    input: BufReader<File>,
    pub(crate) size: u64,
    pub(crate) position: u64,
}

impl Records {
    /// Behind the file's first `from` bytes.
    pub(crate) fn new(file: File, from: u64) -> io::Result<Self> {
        let size = file.metadata()?.len();
        let mut input = BufReader::new(file);
        input.seek(SeekFrom::Start(from))?;
        Ok(Self {
            input,
            size,
            position: from,
        })
    }

    /// The next record; `None` where it does not lie in the file.
    pub(crate) fn step(&mut self) -> io::Result<Option<RecordAt>> {
        let at = self.position;
        let Some(header_length) = self.length_at(at)? else {
            return Ok(None);
        };
        let header = self.read(at + 4, header_length)?;
        let Some(data_length) = self.length_at(at + 4 + header_length)? else {
            return Ok(None);
        };
        let data_at = at + 8 + header_length;
        self.position = data_at + data_length;
        Ok(Some(RecordAt {
            at,
            header,
            data_at,
            data_length,
        }))
    }

    /// A length that stands at `at`, if what it measures ends in the file.
    fn length_at(&mut self, at: u64) -> io::Result<Option<u64>> {
        if at + 4 > self.size {
            return Ok(None);
        }
        let bytes = self.read(at, 4)?;
        let length = bytes
            .iter()
            .rev()
            .fold(0, |sum, byte| sum << 8 | u64::from(*byte));
        Ok((at + 4 + length <= self.size && length <= LARGEST_RECORD).then_some(length))
    }

    /// Bytes that lie in the file.
    pub(crate) fn read(&mut self, at: u64, length: u64) -> io::Result<Vec<u8>> {
        let here = self.input.stream_position()?;
        self.input
            .seek_relative(at.cast_signed() - here.cast_signed())?;
        let mut bytes = vec![0; length as usize];
        self.input.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

/// The records inside a chunk: header and data; ends early where one is cut.
pub(crate) fn inner_records(mut bytes: &[u8]) -> impl Iterator<Item = (Header<'_>, &[u8])> {
    std::iter::from_fn(move || {
        let header = Header::parse(take_counted(&mut bytes)?)?;
        Some((header, take_counted(&mut bytes)?))
    })
}
