//! Opening files.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// Opens a file to read; a pipe or device, at which that would wait for whoever writes, is an error.
pub(crate) fn open_file(path: &Path) -> io::Result<File> {
    let found = fs::metadata(path)?;
    if found.is_file() || found.is_dir() {
        return File::open(path);
    }
    Err(io::Error::new(
        io::ErrorKind::InvalidInput,
        "a pipe or device; copy what comes out of it into a file first",
    ))
}
