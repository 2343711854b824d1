//! rosbag2's own compression: of whole files, or of each message.

use std::io;
use std::path::Path;

use tempfile::TempPath;

use crate::chunk::decompress;
use crate::error::{BagError, io_error};
use crate::message::Message;
use crate::walk::LARGEST_RECORD;

/// How a Zstandard frame begins. CDR begins with a zero.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];

/// A message as it was before it was packed, if it was: metadata.yaml says so, which a file by itself
/// does not have.
pub(crate) fn unpacked(message: Message) -> Result<Message, BagError> {
    if message.topic.message_encoding != "cdr" || !message.payload.starts_with(&ZSTD_MAGIC) {
        return Ok(message);
    }
    let (payload, fault) = decompress("zstd", &message.payload, LARGEST_RECORD);
    match fault {
        None => Ok(Message { payload, ..message }),
        Some(reason) => Err(BagError::Decode {
            topic: message.topic.name.clone(),
            log_time: message.log_time,
            reason,
        }),
    }
}

/// A packed file, unpacked into the system's folder for temporary files.
pub(crate) fn unpacked_file(path: &Path) -> Result<TempPath, BagError> {
    let packed = cromosim_spatial::open_file(path).map_err(io_error(path, "open"))?;
    let mut whole = tempfile::NamedTempFile::new().map_err(io_error(path, "unpack"))?;
    let mut decoder = zstd::stream::read::Decoder::new(packed).map_err(io_error(path, "unpack"))?;
    io::copy(&mut decoder, &mut whole).map_err(io_error(path, "unpack"))?;
    Ok(whole.into_temp_path())
}
