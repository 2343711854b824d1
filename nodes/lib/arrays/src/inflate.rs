//! zlib and gzip streams.

use std::io::Read;

use flate2::read::MultiGzDecoder;
use flate2::{Decompress, FlushDecompress, Status};

use crate::limits::{Budget, Limits};

/// The content of a zlib stream; flate2's reader would take one that is cut short for whole.
pub(crate) fn inflated(bytes: &[u8], limits: Limits) -> Result<Vec<u8>, String> {
    let (mut stream, mut content, mut part) =
        (Decompress::new(true), Vec::new(), vec![0; 64 << 10]);
    loop {
        let (read, written) = (stream.total_in(), stream.total_out());
        let rest = usize::try_from(read)
            .ok()
            .and_then(|read| bytes.get(read..))
            .unwrap_or_default();
        let status = stream
            .decompress(rest, &mut part, FlushDecompress::None)
            .map_err(|error| format!("zlib stream, byte {read}: {error}"))?;
        let new = part
            .get(..(stream.total_out() - written) as usize)
            .unwrap_or_default();
        if content.len() as u64 + new.len() as u64 > limits.decoded_bytes {
            return Err(Budget::new(limits, 0).too_much());
        }
        content.extend_from_slice(new);
        match status {
            Status::StreamEnd => return Ok(content),
            _ if stream.total_in() == read && new.is_empty() => {
                return Err("the zlib stream is cut short".to_owned());
            }
            _ => {}
        }
    }
}

/// The content of a gzip stream, of all its members.
pub(crate) fn unzipped(bytes: &[u8], limits: Limits) -> Result<Vec<u8>, String> {
    let mut content = Vec::new();
    let read = MultiGzDecoder::new(bytes)
        .take(limits.decoded_bytes.saturating_add(1))
        .read_to_end(&mut content);
    read.map_err(|error| format!("gzip stream: {error}"))?;
    if content.len() as u64 > limits.decoded_bytes {
        return Err(Budget::new(limits, 0).too_much());
    }
    Ok(content)
}
