//! Errors of this crate.

use std::io;
use std::path::PathBuf;

/// An error of this crate; the message names the file, the place and what to do. `key` is empty
/// where the file as a whole is meant.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ArraysError {
    /// The file cannot be opened.
    #[error("{}: cannot open: {source}", path.display())]
    Open {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// What the operating system or the decompressor says.
        source: io::Error,
    },
    /// The file's bytes cannot be read.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// What the operating system or the decompressor says.
        source: io::Error,
    },
    /// No container of arrays begins like this.
    #[error("{}: begins with {start}, which no .npy, .npz, pickle, joblib, torch or .mat file does", path.display())]
    Unrecognised {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// Its first bytes, those that are no letters as escapes.
        start: String,
    },
    /// HDF5, which this reader does not know.
    #[error(
        "{}: HDF5 (as MATLAB 7.3 writes it too), which is not read; save it by MATLAB's `save -v7`, or as npz by h5py and numpy.savez",
        path.display()
    )]
    Hdf5 {
        /// The file, as it was named to the reader.
        path: PathBuf,
    },
    /// The file's zip directory is unsound.
    #[error("{}: not a zip archive (.npz, .pt) ({source}); it may be cut short", path.display())]
    Archive {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// What the operating system or the decompressor says.
        source: io::Error,
    },
    /// An array cannot be decoded.
    #[error("{}: {}unreadable: {source}", path.display(), at(key))]
    Unreadable {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// Key of the array within the file.
        key: String,
        /// What the operating system or the decompressor says.
        source: io::Error,
    },
    /// A pickle is unsound, or holds what this reader does not know.
    #[error("{}: {}pickle, byte {offset}: {reason}", path.display(), at(key))]
    Pickle {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// The entry that is a pickle.
        key: String,
        /// Where in the (decompressed) pickle.
        offset: usize,
        /// What is wrong, in words.
        reason: String,
    },
    /// A pickle names what this reader does not rebuild.
    #[error(
        "{}: {}pickle, byte {offset}: refers to `{name}`, which this reader does not rebuild; save plain arrays, for instance by numpy.savez",
        path.display(), at(key)
    )]
    Refused {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// The entry that is a pickle.
        key: String,
        /// Where in the (decompressed) pickle.
        offset: usize,
        /// The Python name, module first.
        name: String,
    },
    /// A key that must be there is missing.
    #[error("{}: key {key} is missing; there are: {known}", path.display())]
    MissingKey {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// The key that was asked for.
        key: String,
        /// The keys that are there.
        known: String,
    },
    /// A value is of another type.
    #[error("{}: {}is {found}, expected {expected}", path.display(), at(key))]
    Type {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// Keys from the root to the value, joined by dots.
        key: String,
        /// Python's type of the value, and a glimpse of it.
        found: String,
        /// What would suit, in words.
        expected: String,
    },
    /// An array holds elements of a type that does not suit.
    #[error("{}: {}elements are {found}, expected {expected}", path.display(), at(key))]
    ElementType {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// Key of the array within the file.
        key: String,
        /// numpy's type description in the file.
        found: String,
        /// What would suit, in words.
        expected: &'static str,
    },
    /// An array has an unsuitable shape.
    #[error("{}: {}shape is {found:?}, expected {expected}", path.display(), at(key))]
    Shape {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// Key of the array within the file.
        key: String,
        /// The shape in the file.
        found: Vec<u64>,
        /// What would suit, in words.
        expected: String,
    },
    /// A value is NaN or infinite.
    #[error("{}: {}element {element} (C order) is {value}", path.display(), at(key))]
    NotFinite {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// Key of the array within the file.
        key: String,
        /// Flat index, last dimension fastest.
        element: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// More than the limits allow.
    #[error("{}: {}{bytes} bytes or more, but {limit} are allowed", path.display(), at(key))]
    TooLarge {
        /// The file, as it was named to the reader.
        path: PathBuf,
        /// Key of the array within the file.
        key: String,
        /// Bytes that it takes, or more.
        bytes: u64,
        /// Most bytes that are allowed.
        limit: u64,
    },
}

fn at(key: &str) -> String {
    if key.is_empty() {
        String::new()
    } else {
        format!("key {key}: ")
    }
}

pub(crate) fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message.into())
}
