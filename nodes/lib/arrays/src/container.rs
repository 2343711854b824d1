//! A file of arrays, whatever wrote it.

use std::collections::HashMap;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use flate2::read::MultiGzDecoder;
use flate2::{Decompress, FlushDecompress, Status};
use zip::ZipArchive;

use crate::ArraysError;
use crate::blob::Blob;
use crate::entry::Entry;
use crate::limits::{Budget, Limits};
use crate::mat;
use crate::npy::{self, NpyHeader};
use crate::npz::{NpzReader, io_error, names, read_entry};
use crate::pickle::{self, Fault, LEGACY_START, Reason};
use crate::value::Value;

/// How HDF5 begins.
const HDF5_START: &[u8] = b"\x89HDF\r\n\x1a\n";

/// How a file of arrays is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A single numpy array, possibly of pickled objects.
    Npy,
    /// A zip archive: `.npz`, or torch's `.pt` since version 1.6.
    Zip,
    /// A pickle, joblib's uncompressed files among them.
    Pickle,
    /// torch's `.pt` before version 1.6.
    TorchLegacy,
    /// A pickle within a zlib stream, as joblib compresses.
    Zlib,
    /// A pickle within a gzip stream.
    Gzip,
    /// MATLAB's `.mat` of versions 5 to 7.
    Mat,
    /// HDF5, as MATLAB 7.3 writes it too: told, but not read.
    Hdf5,
}

impl Format {
    /// Tells by the first and the last bytes of a file; `None` for anything else. Leaves `reader`
    /// at its start.
    ///
    /// # Errors
    /// What `reader` says.
    pub fn of(reader: &mut (impl Read + Seek)) -> io::Result<Option<Self>> {
        let start = first_bytes(reader)?;
        let mut last = [0];
        if reader.seek(SeekFrom::End(0))? > 0 {
            reader.seek(SeekFrom::End(-1))?;
            reader.read_exact(&mut last)?;
        }
        reader.rewind()?;
        Ok(Self::of_bytes(&start, last[0]))
    }

    fn of_bytes(start: &[u8], last: u8) -> Option<Self> {
        match *start {
            _ if start.starts_with(npy::MAGIC) => Some(Self::Npy),
            _ if start.starts_with(b"PK\x03\x04") || start.starts_with(b"PK\x05\x06") => {
                Some(Self::Zip)
            }
            _ if start.starts_with(mat::START) => Some(Self::Mat),
            _ if start.starts_with(HDF5_START) || start.starts_with(b"MATLAB 7.") => {
                Some(Self::Hdf5)
            }
            _ if start.starts_with(LEGACY_START) => Some(Self::TorchLegacy),
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            // zlib's two header bytes are a multiple of 31.
            [0x78, flags, ..] if (0x78_00 + u32::from(flags)) % 31 == 0 => Some(Self::Zlib),
            [0x80, 2..=5, ..] => Some(Self::Pickle),
            // Protocols 0 and 1 begin with an object and end with the opcode that stops.
            [
                b'(' | b'}' | b']' | b')' | b'c' | b'V' | b'X' | b'S' | b'U' | b'T' | b'N' | b'I'
                | b'J' | b'K' | b'M' | b'F' | b'G' | b'L',
                ..,
            ] if last == b'.' => Some(Self::Pickle),
            _ => None,
        }
    }
}

fn first_bytes(reader: &mut (impl Read + Seek)) -> io::Result<Vec<u8>> {
    reader.rewind()?;
    let mut start = Vec::new();
    reader.by_ref().take(16).read_to_end(&mut start)?;
    Ok(start)
}

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
        let file = std::fs::File::open(path).map_err(|source| ArraysError::Open {
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

    /// As [`Self::new`], but of a pickle the entries `skipped` (keys from the root on) are left out
    /// unread: there, and only there, it may hold objects that this reader does not rebuild. They
    /// are not interpreted, and nothing of them can be asked for.
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
        let path: Arc<Path> = Arc::from(path);
        let Some(format) = Format::of(&mut reader).map_err(cannot_read)? else {
            let start = first_bytes(&mut reader).map_err(cannot_read)?;
            let start = if start.is_empty() {
                "nothing".to_owned()
            } else {
                start.escape_ascii().to_string()
            };
            return Err(ArraysError::Unrecognised {
                path: path.to_path_buf(),
                start,
            });
        };
        if format == Format::Hdf5 {
            return Err(ArraysError::Hdf5 {
                path: path.to_path_buf(),
            });
        }
        if format == Format::Zip {
            let archive = ZipArchive::new(reader);
            let archive = archive.map_err(|error| ArraysError::Archive {
                path: path.to_path_buf(),
                source: io_error(error),
            })?;
            let pickle = names(&archive)
                .into_iter()
                .find(|name| name == "data.pkl" || name.ends_with("/data.pkl"));
            let content = match pickle {
                Some(pickle) => Content::Whole(read_torch(archive, &pickle, &path, limits)?),
                None => Content::Npz(NpzReader::from_archive(archive, Arc::clone(&path), limits)),
            };
            return Ok(Self {
                path,
                format,
                content,
            });
        }
        let length = reader
            .seek(SeekFrom::End(0))
            .and_then(|length| reader.rewind().map(|()| length))
            .map_err(cannot_read)?;
        if length > limits.decoded_bytes {
            let limit = limits.decoded_bytes;
            return Err(ArraysError::TooLarge {
                path: path.to_path_buf(),
                key: String::new(),
                bytes: length,
                limit,
            });
        }
        let mut bytes = Vec::new();
        reader
            .take(limits.decoded_bytes)
            .read_to_end(&mut bytes)
            .map_err(cannot_read)?;
        let value =
            read_whole(bytes, format, limits, skipped).map_err(|fault| match fault.reason {
                Reason::Unsound(reason) if format == Format::Mat => ArraysError::Unreadable {
                    path: path.to_path_buf(),
                    key: String::new(),
                    source: crate::error::invalid(reason),
                },
                _ => pickle_error(&path, "", fault),
            })?;
        Ok(Self {
            path,
            format,
            content: Content::Whole(value),
        })
    }

    /// How the file is packed.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The file's name.
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
                Value::Dict(Arc::new(crate::value::Dict::new(pairs)))
            }
        };
        Ok(Entry {
            path: Arc::clone(&self.path),
            key: String::new(),
            value,
        })
    }
}

pub(crate) fn pickle_error(path: &Path, key: &str, fault: Fault) -> ArraysError {
    let (path, key, offset) = (path.to_owned(), key.to_owned(), fault.offset);
    match fault.reason {
        Reason::Unsound(reason) => ArraysError::Pickle {
            path,
            key,
            offset,
            reason,
        },
        Reason::Refused(name) => ArraysError::Refused {
            path,
            key,
            offset,
            name,
        },
    }
}

fn read_whole(
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

/// A zlib stream's content; flate2's reader would take a cut one for whole.
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

fn unzipped(bytes: &[u8], limits: Limits) -> Result<Vec<u8>, String> {
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

/// A torch archive: `FOLDER/data.pkl`, and of each storage `FOLDER/data/KEY`.
fn read_torch<R: Read + Seek>(
    mut archive: ZipArchive<R>,
    pickle: &str,
    path: &Path,
    limits: Limits,
) -> Result<Value, ArraysError> {
    let folder = pickle.strip_suffix("data.pkl").unwrap_or_default();
    let mut left = limits.decoded_bytes;
    let mut read = |name: &str| -> Result<Option<Vec<u8>>, String> {
        let Some((bytes, whole)) = read_entry(&mut archive, name, left)
            .map_err(|error| format!("entry {name}: {error}"))?
        else {
            return Ok(None);
        };
        left = if whole {
            left - bytes.len() as u64
        } else {
            return Err(Budget::new(limits, 0).too_much());
        };
        Ok(Some(bytes))
    };
    let failed = |reason: String| ArraysError::Unreadable {
        path: path.to_owned(),
        key: pickle.to_owned(),
        source: crate::error::invalid(reason),
    };
    if read(&format!("{folder}byteorder"))
        .map_err(failed)?
        .is_some_and(|order| order.starts_with(b"big"))
    {
        return Err(failed(
            "torch wrote it on a big-endian machine, which this reader does not know".to_owned(),
        ));
    }
    let content = Blob::from(
        read(pickle)
            .map_err(failed)?
            .ok_or_else(|| failed("missing".to_owned()))?,
    );
    let mut known: HashMap<String, Blob> = HashMap::new();
    let mut storage = |key: &str| -> Result<Blob, String> {
        if let Some(bytes) = known.get(key) {
            return Ok(bytes.clone());
        }
        let bytes = read(&format!("{folder}data/{key}"))?
            .ok_or_else(|| format!("storage {key} is missing"))?;
        let bytes = Blob::from(bytes);
        known.insert(key.to_owned(), bytes.clone());
        Ok(bytes)
    };
    let mut budget = Budget::new(limits, content.len() as u64);
    let value = pickle::read_zipped(&content, &mut budget, &mut storage);
    value.map_err(|fault| pickle_error(path, pickle, fault))
}
