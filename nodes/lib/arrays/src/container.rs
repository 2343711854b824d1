//! A file of arrays, whatever wrote it.

use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use zip::ZipArchive;

use crate::ArraysError;
use crate::blob::Blob;
use crate::entry::Entry;
use crate::error::invalid;
use crate::file::open_file;
use crate::format::{Format, first_bytes};
use crate::inflate::{inflated, unzipped};
use crate::limits::{Budget, Limits};
use crate::mat;
use crate::npy::{self, NpyHeader};
use crate::npz::{NpzReader, io_error, names};
use crate::pickle::{self, Fault, LEGACY_START, Reason};
use crate::torch_archive::read_torch;
use crate::value::{Dict, Value};

/// A file of arrays. Of an npz, opening reads the directory only and each array is read when it is
/// asked for; any other file is read whole, and its arrays refer to it.
#[derive(Debug)]
pub struct Container<R> {
    path: Arc<Path>,
    format: Format,
    content: Content<R>,
}

#[derive(Debug)]
enum Content<R> {
    Npz(NpzReader<R>),
    Whole(Value),
}

impl Container<BufReader<std::fs::File>> {
    /// Opens the file at `path`; its content tells what it is, its name does not matter.
    ///
    /// # Errors
    /// Any [`ArraysError`] but those of accessors.
    pub fn open(path: &Path) -> Result<Self, ArraysError> {
        let file = open_file(path).map_err(|source| ArraysError::Open {
            path: path.to_owned(),
            source,
        })?;
        Self::new(BufReader::new(file), path, Limits::default())
    }
}

impl<R: Read + Seek> Container<R> {
    /// Reads from `reader`; `path` only names it in errors.
    ///
    /// # Errors
    /// Any [`ArraysError`] but those of accessors.
    pub fn new(reader: R, path: &Path, limits: Limits) -> Result<Self, ArraysError> {
        Self::without(reader, path, limits, &[])
    }

    /// As [`Self::new`], but the entries `skipped` of a pickle (paths of keys from its root on) are
    /// left out unread: there, and only there, it may hold objects that this reader does not rebuild.
    /// They are not interpreted, and nothing of them can be asked for.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn without(
        mut reader: R,
        path: &Path,
        limits: Limits,
        skipped: &'static [&'static [&'static str]],
    ) -> Result<Self, ArraysError> {
        let cannot_read = |source| ArraysError::Read {
            path: path.to_owned(),
            source,
        };
        let bytes = reader.seek(SeekFrom::End(0)).map_err(cannot_read)?;
        reader.rewind().map_err(cannot_read)?;
        let limits = limits.of_file(bytes);
        let path: Arc<Path> = Arc::from(path);
        let Some(format) = Format::detect(&mut reader).map_err(cannot_read)? else {
            let start = first_bytes(&mut reader).map_err(cannot_read)?;
            return Err(unrecognised(&path, &start));
        };
        let content = match format {
            Format::Hdf5 => {
                return Err(ArraysError::Hdf5 {
                    path: path.to_path_buf(),
                });
            }
            Format::Zip => read_zip(reader, &path, limits)?,
            _ => Content::Whole(read_whole(reader, &path, format, limits, skipped)?),
        };
        Ok(Self {
            path,
            format,
            content,
        })
    }

    /// How the file is packed.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The file, as it was named to the reader.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The names of an npz' arrays, sorted, or the text keys of a dictionary in the file's order.
    pub fn keys(&self) -> Vec<String> {
        match &self.content {
            Content::Npz(npz) => npz.keys(),
            Content::Whole(value) => match value.unwrapped() {
                Value::Dict(dict) => dict
                    .pairs()
                    .iter()
                    .filter_map(|(key, _)| key.text().map(|text| text.to_string()))
                    .collect(),
                _ => Vec::new(),
            },
        }
    }

    /// Whether there is something under `key`.
    pub fn has(&self, key: &str) -> bool {
        self.keys().iter().any(|known| known == key)
    }

    /// Element type and shape of an npz' array without its elements; `None` where there is none,
    /// and for files that are read whole.
    ///
    /// # Errors
    /// [`ArraysError::Unreadable`].
    pub fn header(&mut self, key: &str) -> Result<Option<NpyHeader>, ArraysError> {
        match &mut self.content {
            Content::Npz(npz) => npz.header(key),
            Content::Whole(_) => Ok(None),
        }
    }

    /// What the file has under `key`, `None` where it has nothing.
    ///
    /// # Errors
    /// [`ArraysError::Unreadable`], [`ArraysError::TooLarge`], [`ArraysError::Pickle`],
    /// [`ArraysError::Refused`], of npz files only.
    pub fn get(&mut self, key: &str) -> Result<Option<Entry>, ArraysError> {
        match &mut self.content {
            Content::Npz(npz) => npz.entry(key),
            Content::Whole(value) => Ok(Entry {
                path: Arc::clone(&self.path),
                key: String::new(),
                value: value.clone(),
            }
            .get(key)),
        }
    }

    /// As [`Self::get`] for what must be there.
    ///
    /// # Errors
    /// [`ArraysError::MissingKey`] with the keys that there are; [`ArraysError::Type`] where the
    /// file holds no dictionary.
    pub fn at(&mut self, key: &str) -> Result<Entry, ArraysError> {
        match &mut self.content {
            Content::Npz(npz) => npz.at(key),
            Content::Whole(value) => Entry {
                path: Arc::clone(&self.path),
                key: String::new(),
                value: value.clone(),
            }
            .at(key),
        }
    }

    /// Everything: the object that a pickle holds; of an npz, a dictionary of all its arrays.
    ///
    /// # Errors
    /// As [`Self::get`].
    pub fn root(&mut self) -> Result<Entry, ArraysError> {
        let value = match &mut self.content {
            Content::Whole(value) => value.clone(),
            Content::Npz(npz) => {
                let mut pairs = Vec::new();
                for key in npz.keys() {
                    if let Some(entry) = npz.entry(&key)? {
                        pairs.push((Value::Text(key.into()), entry.value));
                    }
                }
                Value::Dict(Arc::new(Dict::new(pairs)))
            }
        };
        Ok(Entry {
            path: Arc::clone(&self.path),
            key: String::new(),
            value,
        })
    }
}

fn unrecognised(path: &Path, start: &[u8]) -> ArraysError {
    let start = if start.is_empty() {
        "nothing".to_owned()
    } else {
        start.escape_ascii().to_string()
    };
    ArraysError::Unrecognised {
        path: path.to_owned(),
        start,
    }
}

/// A zip archive: torch's, which holds a pickle, or an npz.
fn read_zip<R: Read + Seek>(
    reader: R,
    path: &Arc<Path>,
    limits: Limits,
) -> Result<Content<R>, ArraysError> {
    let archive = ZipArchive::new(reader).map_err(|error| ArraysError::Archive {
        path: path.to_path_buf(),
        source: io_error(error),
    })?;
    let pickle = names(&archive)
        .into_iter()
        .find(|name| name == "data.pkl" || name.ends_with("/data.pkl"));
    Ok(match pickle {
        Some(pickle) => Content::Whole(read_torch(archive, &pickle, path, limits)?),
        None => Content::Npz(NpzReader::from_archive(archive, Arc::clone(path), limits)),
    })
}

/// The value of a file that is no archive.
fn read_whole(
    mut reader: impl Read + Seek,
    path: &Path,
    format: Format,
    limits: Limits,
    skipped: &'static [&'static [&'static str]],
) -> Result<Value, ArraysError> {
    let cannot_read = |source| ArraysError::Read {
        path: path.to_owned(),
        source,
    };
    let length = reader
        .seek(SeekFrom::End(0))
        .and_then(|length| reader.rewind().map(|()| length))
        .map_err(cannot_read)?;
    if length > limits.decoded_bytes {
        return Err(ArraysError::TooLarge {
            path: path.to_owned(),
            key: String::new(),
            bytes: length,
            limit: limits.decoded_bytes,
        });
    }
    let mut bytes = Vec::new();
    reader
        .take(limits.decoded_bytes)
        .read_to_end(&mut bytes)
        .map_err(cannot_read)?;
    decoded(bytes, format, limits, skipped).map_err(|fault| match fault.reason {
        Reason::Unsound(reason) if format == Format::Mat => ArraysError::Unreadable {
            path: path.to_owned(),
            key: String::new(),
            source: invalid(reason),
        },
        _ => fault.into_error(path, ""),
    })
}

fn decoded(
    bytes: Vec<u8>,
    format: Format,
    limits: Limits,
    skipped: &'static [&'static [&'static str]],
) -> Result<Value, Fault> {
    let bytes = match format {
        Format::Zlib => inflated(&bytes, limits).map_err(|message| Fault::new(0, message))?,
        Format::Gzip => unzipped(&bytes, limits).map_err(|message| Fault::new(0, message))?,
        _ => bytes,
    };
    let mut budget = Budget::new(limits, bytes.len() as u64);
    let content = Blob::from(bytes);
    match format {
        Format::Npy => npy::read(&content, &mut budget),
        Format::Mat => mat::read(&content, &mut budget).map_err(|message| Fault::new(0, message)),
        _ if content.starts_with(LEGACY_START) => pickle::read_legacy(&content, &mut budget),
        _ => pickle::read(&content, &mut Budget { skipped, ..budget }),
    }
}
