//! Weights in safetensors files, by PyTorch's names; the metadata's key `cromosim` holds JSON:
//! `shape`, the network's shape, and `notes`, a map of texts.

use std::collections::BTreeMap;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::shape::{NetworkShape, Tensor};
use crate::tensors::{Named, TensorFile, read_bounded, to_bytes, write_whole};
use crate::{LearnedError, Network};

/// The metadata's key.
const KEY: &str = "cromosim";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header<S> {
    shape: S,
    #[serde(default)]
    notes: BTreeMap<String, String>,
}

impl Network {
    /// The bytes of a safetensors file; notes: whatever is to stand beside the weights.
    ///
    /// # Errors
    /// Where they cannot be made; the message names `path`, under which they are meant to lie.
    pub fn to_bytes(
        &self,
        notes: &BTreeMap<String, String>,
        path: &Path,
    ) -> Result<Vec<u8>, LearnedError> {
        weights_to_bytes(
            (self.shape(), self.shape().tensors()),
            self.parameters(),
            notes,
            path,
        )
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
        Self::from_bytes(&read_bounded(path, 1)?, path)
    }

    /// As [`Network::read`], from bytes; `path` stands in messages. What is allocated is bounded by
    /// the bytes' length.
    ///
    /// # Errors
    /// Where the bytes are not such a file, or its tensors are not those of the shape in its
    /// metadata.
    pub fn from_bytes(
        bytes: &[u8],
        path: &Path,
    ) -> Result<(Self, BTreeMap<String, String>), LearnedError> {
        let sound = |shape: &NetworkShape| shape.check().map(|()| shape.tensors());
        let (shape, parameters, notes) = read_weights(bytes, path, sound)?;
        Ok((Self::from_parameters(shape, parameters), notes))
    }
}

/// The bytes of a file; shape: with its tensors.
pub(crate) fn weights_to_bytes<S: Serialize + Clone>(
    (shape, tensors): (&S, Vec<Tensor>),
    parameters: &[f32],
    notes: &BTreeMap<String, String>,
    path: &Path,
) -> Result<Vec<u8>, LearnedError> {
    let header = Header {
        shape: shape.clone(),
        notes: notes.clone(),
    };
    let named = tensors.into_iter().map(|tensor| Named {
        name: tensor.name,
        shape: tensor.shape,
        values: &parameters[tensor.range],
    });
    to_bytes(named.collect(), KEY, &header, path)
}

/// Shape, all parameters in the order of its tensors, and notes.
type Weights<S> = (S, Vec<f32>, BTreeMap<String, String>);

/// sound: the tensors of a shape that can be.
pub(crate) fn read_weights<S: DeserializeOwned>(
    bytes: &[u8],
    path: &Path,
    sound: impl Fn(&S) -> Result<Vec<Tensor>, LearnedError>,
) -> Result<Weights<S>, LearnedError> {
    let file = TensorFile::parse(bytes, path)?;
    let Header { shape, notes } = file.header(KEY)?;
    let tensors = sound(&shape).map_err(|error| LearnedError::Metadata {
        path: path.into(),
        key: KEY,
        reason: error.to_string(),
    })?;
    file.refuse_others(|name| tensors.iter().any(|tensor| tensor.name == name))?;
    // Every tensor is checked before memory is taken for any.
    tensors
        .iter()
        .try_for_each(|tensor| file.check(&tensor.name, &tensor.shape))?;
    let mut parameters = Vec::new();
    for tensor in &tensors {
        parameters.extend(file.values(&tensor.name, &tensor.shape)?);
    }
    Ok((shape, parameters, notes))
}

#[cfg(test)]
#[path = "weights_tests.rs"]
mod tests;
