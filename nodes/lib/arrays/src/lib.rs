//! Containers of arrays, as tools around body models and motion write them: `.npy`, `.npz`, pickles
//! of protocols 0 to 5, joblib files (plain, zlib, gzip), torch files (zip and legacy), MATLAB's
//! `.mat` up to version 7.
//!
//! A file's first bytes tell its format. Nothing is executed: a pickle refers to Python functions
//! by name, and this reader rebuilds what a fixed list names (arrays and scalars of numpy, sparse
//! csc and csr matrices of scipy, chumpy arrays, torch tensors, builtin and ordered dictionaries)
//! and refuses all else by name. What a file declares is checked against the bytes that it has
//! before memory is taken, and [`Limits`] bound what compression, sharing and nesting can multiply.
//!
//! ```
//! use std::io::Cursor;
//! use std::path::Path;
//! use cromosim_arrays::{Container, Limits, NpzWriter};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut writer = NpzWriter::new(Cursor::new(Vec::new()));
//! writer.floats("trans", &[2, 3], &[0.0, 0.5, 1.0, 1.5, 2.0, 2.5])?;
//! let file = writer.finish()?;
//! let mut container = Container::new(file, Path::new("walk.npz"), Limits::default())?;
//! let trans = container.at("trans")?.floats(&[None, Some(3)], "(N, 3)")?;
//! assert_eq!((trans.shape, trans.values[4]), (vec![2, 3], 2.0));
//! # Ok(())
//! # }
//! ```
//!
//! Why an own reader of `.npy`: `npyz` 0.8.4 brings 28 packages, 11 of them new here (a grammar for the
//! Python literal of the header among them), knows no arrays of objects, which need a pickle reader
//! anyway, and with its feature `npz` it takes `zip` 0.6. Here a header is a page, elements are
//! decoded in place from the file's bytes, and [`Limits`] hold for npy as for all others.
//!
//! Why an own pickle reader: `serde-pickle` 1.2 drops the types of numpy arrays and reads no
//! joblib; `repugnant-pickle` 0.0.1 fails on joblib; `pyferrite` 0.0.2 reads most of this, but not
//! protocol 0 nor torch tensors within `.npy`, and is too young to lean on. zip and zlib are left
//! to `zip` and `flate2`.
//!
//! MATLAB's level 5 files are a page of rules over zlib, against five crates behind `matfile` 0.5.
//! HDF5 (MATLAB 7.3) is refused by name: `hdf5-pure` 0.47 has 127 000 lines, breaks its API monthly
//! and has open reports of panics on damaged files; `hdf5-reader` 0.12 has 30 000 and maps files
//! into memory by unsafe code; `hdf5-metno` links the C library.

mod array;
mod blob;
mod container;
mod dtype;
mod entry;
mod error;
mod file;
mod format;
mod inflate;
mod limits;
mod mat;
mod npy;
mod npz;
mod npz_write;
mod numbers;
mod pickle;
mod torch_archive;
mod value;

pub use array::Array;
pub use container::Container;
pub use dtype::{DType, Kind};
pub use entry::Entry;
pub use error::ArraysError;
pub use format::Format;
pub use limits::{ELEMENTS_LIMIT, Limits};
pub use npy::NpyHeader;
pub use npz::NpzReader;
pub use npz_write::NpzWriter;
pub use value::{ArrayData, Dict, Sparse, SparseKind, Value};
