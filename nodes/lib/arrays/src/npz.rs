//! numpy's archives of arrays (`.npz`: a zip of `.npy`), read entry by entry.

use std::io::{BufReader, Read, Seek};
use std::path::Path;
use std::sync::Arc;

use zip::ZipArchive;
use zip::result::ZipError;

use crate::ArraysError;
use crate::array::Array;
use crate::blob::Blob;
use crate::entry::Entry;
use crate::error::invalid;
use crate::file::open_file;
use crate::limits::{Budget, Limits};
use crate::npy::{self, HEADER_BYTES_LIMIT, NpyHeader};

/// An npz archive: opening reads its directory, and each array is read when it is asked for. Errors
/// carry its path and the key.
#[derive(Debug)]
pub struct NpzReader<R> {
    path: Arc<Path>,
    archive: ZipArchive<R>,
    limits: Limits,
}

impl NpzReader<BufReader<std::fs::File>> {
    /// Opens the archive at `path`.
    ///
    /// # Errors
    /// [`ArraysError::Open`], [`ArraysError::Archive`].
    pub fn open(path: &Path) -> Result<Self, ArraysError> {
        let file = open_file(path).map_err(|source| ArraysError::Open {
            path: path.to_owned(),
            source,
        })?;
        Self::new(BufReader::new(file), path)
    }
}

impl<R: Read + Seek> NpzReader<R> {
    /// Reads from `reader` with the default limits; `path` only names it in errors.
    ///
    /// # Errors
    /// [`ArraysError::Archive`].
    pub fn new(reader: R, path: &Path) -> Result<Self, ArraysError> {
        Self::with_limits(reader, path, Limits::default())
    }

    /// As [`Self::new`], with limits on what each array may take.
    ///
    /// # Errors
    /// [`ArraysError::Archive`].
    pub fn with_limits(reader: R, path: &Path, limits: Limits) -> Result<Self, ArraysError> {
        let archive = ZipArchive::new(reader).map_err(|error| ArraysError::Archive {
            path: path.to_owned(),
            source: io_error(error),
        })?;
        Ok(Self {
            path: Arc::from(path),
            archive,
            limits,
        })
    }

    pub(crate) fn from_archive(archive: ZipArchive<R>, path: Arc<Path>, limits: Limits) -> Self {
        Self {
            path,
            archive,
            limits,
        }
    }

    /// The arrays' names, sorted.
    pub fn keys(&self) -> Vec<String> {
        let mut keys: Vec<_> = names(&self.archive)
            .iter()
            .filter_map(|name| name.strip_suffix(".npy").map(str::to_owned))
            .collect();
        keys.sort();
        keys
    }

    /// Element type and shape of the array `key`, without its elements; `None` where there is none.
    ///
    /// # Errors
    /// [`ArraysError::Unreadable`].
    pub fn header(&mut self, key: &str) -> Result<Option<NpyHeader>, ArraysError> {
        let start = read_entry(
            &mut self.archive,
            &format!("{key}.npy"),
            HEADER_BYTES_LIMIT as u64,
        );
        let (start, _) = match start {
            Ok(Some(start)) => start,
            Ok(None) => return Ok(None),
            Err(source) => return Err(self.unreadable(key, source)),
        };
        let (header, _) =
            NpyHeader::parse(&start).map_err(|message| self.unreadable(key, invalid(message)))?;
        Ok(Some(header))
    }

    /// The array `key`, or the objects pickled in it; `None` where there is none.
    ///
    /// # Errors
    /// [`ArraysError::Unreadable`], [`ArraysError::TooLarge`], [`ArraysError::Pickle`],
    /// [`ArraysError::Refused`].
    pub fn entry(&mut self, key: &str) -> Result<Option<Entry>, ArraysError> {
        let limit = self.limits.decoded_bytes;
        let (bytes, whole) = match read_entry(&mut self.archive, &format!("{key}.npy"), limit) {
            Ok(Some(read)) => read,
            Ok(None) => return Ok(None),
            Err(source) => return Err(self.unreadable(key, source)),
        };
        if !whole {
            return Err(ArraysError::TooLarge {
                path: self.path.to_path_buf(),
                key: key.to_owned(),
                bytes: limit.saturating_add(1),
                limit,
            });
        }
        let mut budget = Budget::new(self.limits, bytes.len() as u64);
        let objects =
            NpyHeader::parse(&bytes).is_ok_and(|(header, _)| header.element.contains('O'));
        let value =
            npy::read(&Blob::from(bytes), &mut budget).map_err(|fault| match fault.reason {
                crate::pickle::Reason::Unsound(message) if !objects => {
                    self.unreadable(key, invalid(message))
                }
                _ => fault.into_error(&self.path, key),
            })?;
        Ok(Some(Entry {
            path: Arc::clone(&self.path),
            key: key.to_owned(),
            value,
        }))
    }

    /// As [`Self::entry`] for an array that must be there.
    ///
    /// # Errors
    /// [`ArraysError::MissingKey`] besides those of [`Self::entry`].
    pub fn at(&mut self, key: &str) -> Result<Entry, ArraysError> {
        let missing = |known| ArraysError::MissingKey {
            path: self.path.to_path_buf(),
            key: key.to_owned(),
            known,
        };
        let known = || {
            if self.keys().is_empty() {
                "none".to_owned()
            } else {
                self.keys().join(", ")
            }
        };
        let error = missing(known());
        self.entry(key)?.ok_or(error)
    }

    /// The array `key` as float64, from numbers of any type; `None` where there is none. `expected`
    /// holds the dimensions that are given, and is named by `expectation` in the error.
    ///
    /// # Errors
    /// Those of [`Self::entry`] and [`Entry::floats`].
    pub fn floats(
        &mut self,
        key: &str,
        expected: &[Option<usize>],
        expectation: &str,
    ) -> Result<Option<Array<f64>>, ArraysError> {
        self.entry(key)?
            .map(|entry| entry.floats(expected, expectation))
            .transpose()
    }

    /// The array `key` of integers of any width; `None` where there is none.
    ///
    /// # Errors
    /// Those of [`Self::entry`] and [`Entry::integers`].
    pub fn integers(
        &mut self,
        key: &str,
        expected: &[Option<usize>],
        expectation: &str,
    ) -> Result<Option<Array<i64>>, ArraysError> {
        self.entry(key)?
            .map(|entry| entry.integers(expected, expectation))
            .transpose()
    }

    /// The text in the array `key` of one element; `None` where there is none or it is no text.
    ///
    /// # Errors
    /// Those of [`Self::entry`].
    pub fn text(&mut self, key: &str) -> Result<Option<String>, ArraysError> {
        Ok(self.entry(key)?.and_then(|entry| entry.text().ok()))
    }

    fn unreadable(&self, key: &str, source: std::io::Error) -> ArraysError {
        ArraysError::Unreadable {
            path: self.path.to_path_buf(),
            key: key.to_owned(),
            source,
        }
    }
}

/// The names in an archive, as far as they are text.
pub(crate) fn names<R: Read + Seek>(archive: &ZipArchive<R>) -> Vec<String> {
    archive
        .file_names()
        .filter_map(|name| name.ok().map(std::borrow::Cow::into_owned))
        .collect()
}

/// At most `limit` bytes of an entry, and whether that is all of it; `None` where there is none.
pub(crate) fn read_entry<R: Read + Seek>(
    archive: &mut ZipArchive<R>,
    name: &str,
    limit: u64,
) -> std::io::Result<Option<(Vec<u8>, bool)>> {
    let mut entry = match archive.by_name(name) {
        Ok(entry) => entry,
        Err(ZipError::FileNotFound) => return Ok(None),
        Err(error) => return Err(io_error(error)),
    };
    // The directory may declare any size: memory grows with what comes, one byte beyond the limit
    // at most.
    let mut bytes = Vec::new();
    entry
        .by_ref()
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)?;
    let whole = bytes.len() as u64 <= limit;
    Ok(Some((bytes, whole)))
}

pub(crate) fn io_error(error: ZipError) -> std::io::Error {
    match error {
        ZipError::Io(error) => error,
        other => invalid(other.to_string()),
    }
}
