//! Reading files whose size nobody has promised, and writing files whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
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
    cromosim_spatial::open_file(path)
        .and_then(|file| file.take(count).read_to_end(&mut bytes))
        .map_err(|source| RecordingError::Read {
            path: path.to_owned(),
            source,
        })?;
    Ok(bytes)
}

/// Whether a file or folder would be lost if `path` were written. Devices and pipes are written
/// into, and nothing of them is lost.
pub fn is_in_the_way(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok() && !is_device(path)
}

fn is_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Writes a file under a temporary name beside its own, and gives it its name once it is complete.
///
/// # Errors
/// [`RecordingError::Write`]; [`RecordingError::Exists`] where it is not to be replaced.
pub fn write_file(path: &Path, bytes: &[u8], replace: bool) -> Result<(), RecordingError> {
    write_file_with(path, replace, |file| {
        file.write_all(bytes).map_err(cannot_write(path))
    })
}

/// As [`write_file`], of what `write` writes; nothing is left of a file that it gives up.
///
/// # Errors
/// As [`write_file`], and what `write` says.
pub fn write_file_with<V, E: From<RecordingError>>(
    path: &Path,
    replace: bool,
    write: impl FnOnce(&mut (dyn Write + Send)) -> Result<V, E>,
) -> Result<V, E> {
    let cannot = cannot_write(path);
    if is_device(path) {
        let mut device = File::options().write(true).open(path).map_err(&cannot)?;
        return write(&mut device);
    }
    // Where a link leads, not the link, is replaced.
    let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let folder = place
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    let everybody = <fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(everybody);
    let mut temporary = builder
        .prefix(&format!(".{name}."))
        .suffix(".partial")
        .tempfile_in(folder)
        .map_err(&cannot)?;
    let mut buffered = BufWriter::new(temporary.as_file_mut());
    let value = write(&mut buffered)?;
    buffered.flush().map_err(&cannot)?;
    drop(buffered);
    let persisted = if replace {
        temporary.persist(&place)
    } else {
        temporary.persist_noclobber(&place)
    };
    match persisted {
        Ok(_) => Ok(value),
        Err(error) if error.error.kind() == ErrorKind::AlreadyExists => {
            Err(RecordingError::Exists {
                path: path.to_owned(),
            }
            .into())
        }
        Err(error) => Err(cannot(error.error).into()),
    }
}

fn cannot_write(path: &Path) -> impl Fn(io::Error) -> RecordingError {
    let path = path.to_owned();
    move |source| RecordingError::Write {
        path: path.clone(),
        source,
    }
}
