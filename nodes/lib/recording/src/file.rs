//! Reading files whose size nobody has promised.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::RecordingError;

/// Larger files are refused: a day of readings at 1 kHz is about as large as a table.
const MAX_BYTES: u64 = 16 << 30;
/// What is looked at to tell what a file is: enough for any header.
const HEAD_BYTES: u64 = 1 << 16;

/// All bytes of a file.
///
/// # Errors
/// [`RecordingError::Read`]; [`RecordingError::TooLarge`] beyond 16 GiB.
pub fn read_whole(path: &Path) -> Result<Vec<u8>, RecordingError> {
    let bytes = read_first(path, MAX_BYTES + 1)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(RecordingError::TooLarge {
            path: path.to_owned(),
            most: MAX_BYTES,
        });
    }
    Ok(bytes)
}

/// The first 64 KiB of a file, by which its kind is told.
///
/// # Errors
/// [`RecordingError::Read`].
pub fn read_head(path: &Path) -> Result<Vec<u8>, RecordingError> {
    read_first(path, HEAD_BYTES)
}

fn read_first(path: &Path, count: u64) -> Result<Vec<u8>, RecordingError> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(count).read_to_end(&mut bytes))
        .map_err(|source| RecordingError::Read {
            path: path.to_owned(),
            source,
        })?;
    Ok(bytes)
}
