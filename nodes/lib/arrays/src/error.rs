//! What can go wrong while arrays are read.

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
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file's bytes cannot be read.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// No container of arrays begins like this.
    #[error("{}: begins with {start}, which no .npy, .npz, pickle, joblib, torch or .mat file does", path.display())]
    Unrecognised {
        /// The file.
        path: PathBuf,
        /// Its first bytes.
        start: String,
    },
    /// HDF5, which this reader does not know.
    #[error(
        "{}: HDF5 (as MATLAB 7.3 writes it too), which is not read; save it by MATLAB's `save -v7`, or as npz by h5py and numpy.savez",
        path.display()
    )]
    Hdf5 {
        /// The file.
        path: PathBuf,
    },
    /// The file's zip directory is unsound.
    #[error("{}: not a zip archive (.npz, .pt) ({source}); it may be cut short", path.display())]
    Archive {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// An array cannot be decoded.
    #[error("{}: {}unreadable: {source}", path.display(), at(key))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The array.
        key: String,
        /// The reason.
        source: io::Error,
    },
    /// A pickle is unsound, or holds what this reader does not know.
    #[error("{}: {}pickle, byte {offset}: {reason}", path.display(), at(key))]
    Pickle {
        /// The file.
        path: PathBuf,
        /// The entry that is a pickle.
        key: String,
        /// Where in the (decompressed) pickle.
        offset: usize,
        /// The reason.
        reason: String,
    },
    /// A pickle names what this reader does not rebuild.
    #[error(
        "{}: {}pickle, byte {offset}: refers to `{name}`, which this reader does not rebuild; save plain arrays, for instance by numpy.savez",
        path.display(), at(key)
    )]
    Refused {
        /// The file.
        path: PathBuf,
        /// The entry that is a pickle.
        key: String,
        /// Where in the (decompressed) pickle.
        offset: usize,
        /// The Python name, module first.
        name: String,
    },
    /// Something is missing.
    #[error("{}: key {key} is missing; there are: {known}", path.display())]
    MissingKey {
        /// The file.
        path: PathBuf,
        /// What was looked for.
        key: String,
        /// The keys that are there.
        known: String,
    },
    /// A value is of another type.
    #[error("{}: {}is {found}, expected {expected}", path.display(), at(key))]
    Type {
        /// The file.
        path: PathBuf,
        /// Which value.
        key: String,
        /// What it is.
        found: String,
        /// What suits.
        expected: String,
    },
    /// An array holds elements of a type that does not suit.
    #[error("{}: {}elements are {found}, expected {expected}", path.display(), at(key))]
    ElementType {
        /// The file.
        path: PathBuf,
        /// The array.
        key: String,
        /// numpy's type description in the file.
        found: String,
        /// What suits.
        expected: &'static str,
    },
    /// An array has an unsuitable shape.
    #[error("{}: {}shape is {found:?}, expected {expected}", path.display(), at(key))]
    Shape {
        /// The file.
        path: PathBuf,
        /// The array.
        key: String,
        /// The shape in the file.
        found: Vec<u64>,
        /// What suits.
        expected: String,
    },
    /// A value is NaN or infinite.
    #[error("{}: {}element {element} (C order) is {value}", path.display(), at(key))]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The array.
        key: String,
        /// Flat index, last dimension fastest.
        element: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// More than the limits allow.
    #[error("{}: {}{bytes} bytes or more, but {limit} are allowed", path.display(), at(key))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The array.
        key: String,
        /// Its size.
        bytes: u64,
        /// The largest allowed.
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
