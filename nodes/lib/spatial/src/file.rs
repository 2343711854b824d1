//! Opening files, for the readers of every crate.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Opens a file to read; a pipe or device, at which that would wait for whoever writes, is an error.
///
/// # Errors
/// What the operating system says.
pub fn open_file(path: &Path) -> io::Result<File> {
    let found = fs::metadata(path)?;
    if found.is_file() || found.is_dir() {
        return File::open(path);
    }
    Err(io::Error::new(
        io::ErrorKind::InvalidInput,
        "a pipe or device; copy what comes out of it into a file first",
    ))
}

/// The text of a file that [`open_file`] opens.
///
/// # Errors
/// As there; what is no UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open_file(path)?.read_to_string(&mut text)?;
    Ok(text)
}
