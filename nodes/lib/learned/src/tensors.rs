//! Files of f32 tensors in the safetensors format, with one JSON text in the header's metadata.
//!
//! One, because the crate writes a map of metadata in random order, and the same network is to give
//! the same bytes.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::Path;

use cromosim_spatial::in_plain_words;
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensorError, SafeTensors, serialize};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::LearnedError;
use crate::shape::MOST_PARAMETERS;

/// The header of the largest network takes less.
const MOST_HEADER: u64 = 1 << 24;

/// A tensor to write.
pub(crate) struct Named<'a> {
    pub name: String,
    pub shape: Vec<usize>,
    pub values: &'a [f32],
}

/// The file's bytes; `path` stands in messages.
pub(crate) fn to_bytes<H: Serialize>(
    tensors: Vec<Named<'_>>,
    key: &str,
    header: &H,
    path: &Path,
) -> Result<Vec<u8>, LearnedError> {
    let unsound = |reason: String| LearnedError::Unsound {
        path: path.into(),
        reason,
    };
    let header = serde_json::to_string(header).map_err(|error| unsound(error.to_string()))?;
    let bytes: Vec<Vec<u8>> = tensors
        .iter()
        .map(|tensor| {
            tensor
                .values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect()
        })
        .collect();
    let mut views = Vec::new();
    for (tensor, bytes) in tensors.into_iter().zip(&bytes) {
        let view = TensorView::new(Dtype::F32, tensor.shape, bytes)
            .map_err(|error| unsound(error.to_string()))?;
        views.push((tensor.name, view));
    }
    serialize(views, Some(HashMap::from([(key.to_owned(), header)])))
        .map_err(|error| unsound(error.to_string()))
}

/// Writes beside the target and renames, so that a file is there whole or not at all.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), LearnedError> {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".partial");
    let partial = path.with_file_name(name);
    let written = File::create(&partial)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()));
    written
        .and_then(|()| fs::rename(&partial, path))
        .map_err(|source| {
            // What is left of it helps nobody; the first error is the one to tell.
            let _ = fs::remove_file(&partial);
            LearnedError::Write {
                path: path.into(),
                source,
            }
        })
}

/// The file's bytes, where they are no more than so many copies of the largest network.
pub(crate) fn read_bounded(path: &Path, copies: u64) -> Result<Vec<u8>, LearnedError> {
    let read = |source| LearnedError::Read {
        path: path.into(),
        source,
    };
    let most = copies * 4 * MOST_PARAMETERS + MOST_HEADER;
    let file = cromosim_spatial::open_file(path).map_err(read)?;
    let found = file.metadata().map_err(read)?.len();
    if found > most {
        return Err(LearnedError::FileTooLarge {
            path: path.into(),
            found,
            most,
        });
    }
    let mut bytes = Vec::new();
    file.take(most).read_to_end(&mut bytes).map_err(read)?;
    Ok(bytes)
}

/// A file that was read; what is allocated is bounded by its length.
pub(crate) struct TensorFile<'a> {
    tensors: SafeTensors<'a>,
    metadata: HashMap<String, String>,
    path: &'a Path,
}

impl<'a> TensorFile<'a> {
    pub fn parse(bytes: &'a [u8], path: &'a Path) -> Result<Self, LearnedError> {
        let unsound = |error: SafeTensorError| LearnedError::Unsound {
            path: path.into(),
            reason: error.to_string(),
        };
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(unsound)?;
        let metadata = metadata.metadata().clone().unwrap_or_default();
        Ok(Self {
            tensors: SafeTensors::deserialize(bytes).map_err(unsound)?,
            metadata,
            path,
        })
    }

    /// The JSON text under a key of the metadata.
    pub fn header<H: DeserializeOwned>(&self, key: &'static str) -> Result<H, LearnedError> {
        let wrong = |reason: String| LearnedError::Metadata {
            path: self.path.into(),
            key,
            reason,
        };
        let text = self.metadata.get(key).ok_or_else(|| {
            wrong("missing, so that it is unknown what the tensors are".to_owned())
        })?;
        serde_json::from_str(text).map_err(|error| wrong(in_plain_words(error)))
    }

    /// Refuses tensors that nobody asks for, the first by name.
    pub fn refuse_others(&self, known: impl Fn(&str) -> bool) -> Result<(), LearnedError> {
        match self
            .tensors
            .names()
            .into_iter()
            .filter(|name| !known(name))
            .min()
        {
            Some(unknown) => Err(LearnedError::TensorUnknown {
                path: self.path.into(),
                tensor: unknown.to_owned(),
            }),
            None => Ok(()),
        }
    }

    /// The bytes of a tensor of this shape.
    fn bytes(&self, name: &str, shape: &[usize]) -> Result<&'a [u8], LearnedError> {
        let Ok(view) = self.tensors.tensor(name) else {
            let mut known = self.tensors.names();
            known.sort_unstable();
            return Err(LearnedError::TensorMissing {
                path: self.path.into(),
                tensor: name.to_owned(),
                known: known.join(", "),
            });
        };
        if view.dtype() != Dtype::F32 || view.shape() != shape {
            return Err(LearnedError::Tensor {
                path: self.path.into(),
                tensor: name.to_owned(),
                expected: shape.to_vec(),
                found: view.shape().to_vec(),
                found_type: format!("{:?}", view.dtype()),
            });
        }
        Ok(view.data())
    }

    /// That a tensor of this shape is there.
    pub fn check(&self, name: &str, shape: &[usize]) -> Result<(), LearnedError> {
        self.bytes(name, shape).map(|_| ())
    }

    /// The numbers of a tensor of this shape, all finite.
    pub fn values(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, LearnedError> {
        let values: Vec<f32> = self
            .bytes(name, shape)?
            .as_chunks()
            .0
            .iter()
            .map(|bytes| f32::from_le_bytes(*bytes))
            .collect();
        match values.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(LearnedError::NotFinite {
                path: self.path.into(),
                tensor: name.to_owned(),
                index,
                value: values[index],
            }),
            None => Ok(values),
        }
    }
}
