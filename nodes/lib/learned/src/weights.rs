//! Weights in safetensors files, by PyTorch's names.
//!
//! The header's metadata holds `shape`, the network's shape, and `notes`, a map of texts, both as JSON within the one key `cromosim`: the
//! crate writes a map of metadata in random order, and the same network is to give the same bytes.

use std::collections::{BTreeMap, HashMap};
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::Path;

use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};
use serde::{Deserialize, Serialize};

use crate::shape::{MOST_PARAMETERS, NetworkShape, Tensor};
use crate::{LearnedError, Network};

/// The metadata's key.
const KEY: &str = "cromosim";
/// The header of the largest network takes less.
const MOST_HEADER: u64 = 1 << 24;
const MOST_BYTES: u64 = 4 * MOST_PARAMETERS + MOST_HEADER;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    shape: NetworkShape,
    #[serde(default)]
    notes: BTreeMap<String, String>,
}

impl Network {
    /// The bytes of a safetensors file; notes: whatever is to stand beside the weights.
    ///
    /// # Errors
    /// Where they cannot be made; the message names `path`, under which they are meant to lie.
    pub fn to_bytes(&self, notes: &BTreeMap<String, String>, path: &Path) -> Result<Vec<u8>, LearnedError> {
        let unsound = |reason: String| LearnedError::Unsound { path: path.into(), reason };
        let header = Header { shape: self.shape().clone(), notes: notes.clone() };
        let header = serde_json::to_string(&header).map_err(|error| unsound(error.to_string()))?;
        let bytes: Vec<u8> = self.parameters().iter().flat_map(|value| value.to_le_bytes()).collect();
        let mut views = Vec::new();
        for tensor in self.shape().tensors() {
            let bytes = &bytes[4 * tensor.range.start..4 * tensor.range.end];
            let view = TensorView::new(Dtype::F32, tensor.shape, bytes).map_err(|error| unsound(error.to_string()))?;
            views.push((tensor.name, view));
        }
        serialize(views, Some(HashMap::from([(KEY.to_owned(), header)]))).map_err(|error| unsound(error.to_string()))
    }

    /// Writes a safetensors file, whole or not at all.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write(&self, path: &Path, notes: &BTreeMap<String, String>) -> Result<(), LearnedError> {
        write_whole(path, &self.to_bytes(notes, path)?)
    }

    /// Reads what [`Network::write`] wrote, or PyTorch under the same names.
    ///
    /// # Errors
    /// Where the file cannot be read, or its tensors are not those of the shape in its metadata.
    pub fn read(path: &Path) -> Result<(Self, BTreeMap<String, String>), LearnedError> {
        let read = |source| LearnedError::Read { path: path.into(), source };
        let file = File::open(path).map_err(read)?;
        let found = file.metadata().map_err(read)?.len();
        if found > MOST_BYTES {
            return Err(LearnedError::FileTooLarge { path: path.into(), found, most: MOST_BYTES });
        }
        let mut bytes = Vec::new();
        file.take(MOST_BYTES).read_to_end(&mut bytes).map_err(read)?;
        Self::from_bytes(&bytes, path)
    }

    /// As [`Network::read`], from bytes; `path` stands in messages. What is allocated is bounded by the bytes' length.
    ///
    /// # Errors
    /// Where the bytes are not such a file, or its tensors are not those of the shape in its metadata.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<(Self, BTreeMap<String, String>), LearnedError> {
        let (tensors, header) = parse(bytes, path)?;
        let shape = header.shape;
        shape.check().map_err(|error| metadata_error(path, error.to_string()))?;
        let expected = shape.tensors();
        if let Some(unknown) = tensors.names().into_iter().filter(|name| expected.iter().all(|tensor| tensor.name != *name)).min() {
            return Err(LearnedError::TensorUnknown { path: path.into(), tensor: unknown.to_owned() });
        }
        // Every tensor is checked before memory is taken for any.
        let views = expected.iter().map(|tensor| view(&tensors, tensor, path)).collect::<Result<Vec<_>, _>>()?;
        let mut parameters = Vec::with_capacity(shape.parameters());
        for (tensor, view) in expected.iter().zip(views) {
            parameters.extend(view.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)));
            let values = &parameters[tensor.range.clone()];
            if let Some(index) = values.iter().position(|value| !value.is_finite()) {
                return Err(LearnedError::NotFinite { path: path.into(), tensor: tensor.name.clone(), index, value: values[index] });
            }
        }
        Ok((Self::from_parameters(shape, parameters), header.notes))
    }
}

fn metadata_error(path: &Path, reason: String) -> LearnedError {
    LearnedError::Metadata { path: path.into(), key: KEY, reason }
}

fn parse<'a>(bytes: &'a [u8], path: &Path) -> Result<(SafeTensors<'a>, Header), LearnedError> {
    let unsound = |error: safetensors::SafeTensorError| LearnedError::Unsound { path: path.into(), reason: error.to_string() };
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(unsound)?;
    let text = metadata.metadata().as_ref().and_then(|map| map.get(KEY));
    let text = text.ok_or_else(|| metadata_error(path, "missing, so that the network's shape is unknown".to_owned()))?;
    let header = serde_json::from_str(text).map_err(|error| metadata_error(path, error.to_string()))?;
    Ok((SafeTensors::deserialize(bytes).map_err(unsound)?, header))
}

fn view<'a>(tensors: &SafeTensors<'a>, tensor: &Tensor, path: &Path) -> Result<&'a [u8], LearnedError> {
    let Ok(view) = tensors.tensor(&tensor.name) else {
        let mut known = tensors.names();
        known.sort_unstable();
        return Err(LearnedError::TensorMissing { path: path.into(), tensor: tensor.name.clone(), known: known.join(", ") });
    };
    if view.dtype() != Dtype::F32 || view.shape() != tensor.shape {
        return Err(LearnedError::Tensor {
            path: path.into(),
            tensor: tensor.name.clone(),
            expected: tensor.shape.clone(),
            found: view.shape().to_vec(),
            found_type: format!("{:?}", view.dtype()),
        });
    }
    Ok(view.data())
}

/// Writes beside the target and renames, so that a file is there whole or not at all.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), LearnedError> {
    let write = |source| LearnedError::Write { path: path.into(), source };
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".partial");
    let partial = path.with_file_name(name);
    let written = File::create(&partial).and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()));
    written.and_then(|()| fs::rename(&partial, path)).map_err(|source| {
        // What is left of it helps nobody; the first error is the one to tell.
        let _ = fs::remove_file(&partial);
        write(source)
    })
}

#[cfg(test)]
#[path = "weights_tests.rs"]
mod tests;
