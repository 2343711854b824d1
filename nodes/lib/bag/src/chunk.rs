//! Unpacking chunks, whole ones and ones that a dying recorder left half-written.

use std::io::Read;

use crate::walk::{Fields, LARGEST_RECORD};

/// What stands before the packed records of a chunk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ChunkHeader {
    pub(crate) start_time: u64,
    pub(crate) end_time: u64,
    pub(crate) uncompressed_size: u64,
    pub(crate) uncompressed_crc: u32,
    pub(crate) compression: String,
    pub(crate) compressed_size: u64,
}

/// Bytes that are enough for every chunk header with a compression name of sensible length.
pub(crate) const HEADER_AT_MOST: u64 = 256;

/// The records of a chunk, one after the other, as far as they could be unpacked.
pub(crate) struct Unpacked {
    pub(crate) records: Vec<u8>,
    /// Why there is no more, where something is wrong.
    pub(crate) fault: Option<String>,
}

impl ChunkHeader {
    /// Takes the header off the front of a chunk's body.
    pub(crate) fn take(fields: &mut Fields<'_>) -> Option<Self> {
        Some(Self {
            start_time: fields.u64()?,
            end_time: fields.u64()?,
            uncompressed_size: fields.u64()?,
            uncompressed_crc: fields.u32()?,
            compression: fields.string()?,
            compressed_size: fields.u64()?,
        })
    }
}

/// Unpacks a chunk's body. Of a whole chunk, size and checksum must be right; of a cut one, what is
/// there is given.
pub(crate) fn unpack(body: &[u8]) -> Unpacked {
    let mut fields = Fields(body);
    let Some(header) = ChunkHeader::take(&mut fields) else {
        return Unpacked {
            records: Vec::new(),
            fault: Some("a chunk without a whole header".to_owned()),
        };
    };
    let there = fields
        .0
        .len()
        .min(usize::try_from(header.compressed_size).unwrap_or(usize::MAX));
    let (records, fault) = decompress(
        &header.compression,
        &fields.0[..there],
        header.uncompressed_size.min(LARGEST_RECORD),
    );
    let fault = fault.or_else(|| check(&header, &records));
    Unpacked { records, fault }
}

fn check(header: &ChunkHeader, records: &[u8]) -> Option<String> {
    if records.len() as u64 != header.uncompressed_size {
        return Some(format!(
            "expected a chunk of {} bytes, found {}",
            header.uncompressed_size,
            records.len()
        ));
    }
    let found = crc32fast::hash(records);
    (header.uncompressed_crc != 0 && header.uncompressed_crc != found).then(|| {
        format!(
            "expected the checksum {:08x} for a chunk, found {found:08x}",
            header.uncompressed_crc
        )
    })
}

/// At most `most` bytes, as many as could be unpacked, and what went wrong.
pub(crate) fn decompress(compression: &str, packed: &[u8], most: u64) -> (Vec<u8>, Option<String>) {
    let mut records = Vec::new();
    let read = match compression {
        "" | "none" => packed.take(most).read_to_end(&mut records),
        "zstd" => zstd::stream::read::Decoder::with_buffer(packed)
            .and_then(|decoder| drain(decoder, most, &mut records)),
        "lz4" => lz4::Decoder::new(packed).and_then(|decoder| drain(decoder, most, &mut records)),
        "bz2" => drain(bzip2::read::BzDecoder::new(packed), most, &mut records),
        other => return (records, Some(format!("unknown compression {other:?}"))),
    };
    let fault = read
        .err()
        .map(|error| format!("cannot unpack a chunk: {error}"));
    (records, fault)
}

/// Reads in small steps, so that what came before an error is kept.
fn drain(decoder: impl Read, most: u64, records: &mut Vec<u8>) -> std::io::Result<usize> {
    let mut limited = decoder.take(most);
    let mut step = vec![0; 16 * 1024];
    loop {
        match limited.read(&mut step)? {
            0 => return Ok(records.len()),
            count => records.extend_from_slice(&step[..count]),
        }
    }
}

/// One record inside a chunk.
pub(crate) struct InnerRecord<'a> {
    pub(crate) opcode: u8,
    pub(crate) body: &'a [u8],
}

/// The whole records in unpacked bytes; a ragged end is left out.
pub(crate) fn inner_records(bytes: &[u8]) -> impl Iterator<Item = InnerRecord<'_>> {
    let mut fields = Fields(bytes);
    std::iter::from_fn(move || {
        let opcode = fields.bytes(1)?[0];
        let length = usize::try_from(fields.u64()?).ok()?;
        Some(InnerRecord {
            opcode,
            body: fields.bytes(length)?,
        })
    })
}
