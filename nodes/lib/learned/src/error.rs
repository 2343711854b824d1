//! What can go wrong.

use std::io;
use std::path::PathBuf;

/// Errors of this crate; the message names the file, the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnedError {
    /// A number of a network's shape is out of range.
    #[error("network shape: {field} is {found}, it may be {least} to {most}")]
    Shape {
        /// Which number.
        field: &'static str,
        /// What it is.
        found: usize,
        /// The least it may be.
        least: usize,
        /// The most it may be.
        most: usize,
    },
    /// The shape as a whole is too large.
    #[error("network shape: {found} parameters, at most {most} are supported: choose fewer channels, hidden units or layers")]
    TooLarge {
        /// How many there would be.
        found: u64,
        /// How many there may be.
        most: u64,
    },
    /// An input's length does not fit.
    #[error("network input: {found} numbers, {batch} sequences x {steps} steps x {inputs} inputs are {expected}")]
    Input {
        /// How many there are.
        found: usize,
        /// Sequences.
        batch: usize,
        /// Steps.
        steps: usize,
        /// Width of a step.
        inputs: usize,
        /// How many there have to be.
        expected: usize,
    },
    /// A network that knows the future cannot run step by step.
    #[error("streaming: the network reads its input in both directions; train one with `direction: forward` for live use")]
    NotCausal,
    /// A file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// A file is larger than any network of ours.
    #[error("{}: {found} bytes, weights of a network are at most {most}", path.display())]
    FileTooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        found: u64,
        /// The most it may be.
        most: u64,
    },
    /// The file is not sound.
    #[error("{}: not a sound safetensors file ({reason}); write it anew", path.display())]
    Unsound {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The header lacks the network's shape, or it cannot be read.
    #[error("{}: metadata `{key}`: {reason}; it is written by `cromosim` beside the weights", path.display())]
    Metadata {
        /// The file.
        path: PathBuf,
        /// The key.
        key: &'static str,
        /// The reason.
        reason: String,
    },
    /// A tensor is missing.
    #[error("{}: tensor {tensor} is missing; there are: {known}", path.display())]
    TensorMissing {
        /// The file.
        path: PathBuf,
        /// Which.
        tensor: String,
        /// Those that are there.
        known: String,
    },
    /// A tensor that the network does not have.
    #[error("{}: tensor {tensor} is none of the network's; remove it, or correct the shape in the metadata", path.display())]
    TensorUnknown {
        /// The file.
        path: PathBuf,
        /// Which.
        tensor: String,
    },
    /// A tensor's shape or type does not fit.
    #[error("{}: tensor {tensor}: expected F32 of shape {expected:?}, found {found_type} of shape {found:?}", path.display())]
    Tensor {
        /// The file.
        path: PathBuf,
        /// Which.
        tensor: String,
        /// The shape it has to have.
        expected: Vec<usize>,
        /// The shape it has.
        found: Vec<usize>,
        /// The type it has.
        found_type: String,
    },
    /// A weight that is not a number.
    #[error("{}: tensor {tensor}, element {index} is {value}; weights are finite", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Which tensor.
        tensor: String,
        /// Which element.
        index: usize,
        /// What it is.
        value: f32,
    },
}
