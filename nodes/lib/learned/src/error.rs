//! What can go wrong.

use std::io;
use std::path::PathBuf;

use cromosim_body::BodyError;
use cromosim_imu::{EffectError, ImuError};
use cromosim_spatial::SpatialError;

/// Errors of this crate; the message names the file, the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnedError {
    /// No model of this name comes with the suite.
    #[error(
        "{name}: neither a folder with networks nor a model that comes with the suite ({known})"
    )]
    UnknownModel {
        /// What was asked for.
        name: String,
        /// Those there are.
        known: String,
    },
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
    #[error(
        "network shape: {found} parameters, at most {most} are supported: choose fewer channels, hidden units or layers"
    )]
    TooLarge {
        /// How many there would be.
        found: u64,
        /// How many there may be.
        most: u64,
    },
    /// An input's length does not fit.
    #[error(
        "network input: {found} numbers, {batch} sequences x {steps} steps x {inputs} inputs are {expected}"
    )]
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
    #[error(
        "streaming: the network reads its input in both directions; train one with `direction: forward` for live use"
    )]
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
    /// A file that is not YAML, or has wrong or unknown fields.
    #[error("{file}: {source}")]
    Yaml {
        /// The file's name.
        file: String,
        /// Why, with line and column.
        source: serde_norway::Error,
    },
    /// A file of another kind or version.
    #[error("{file}: schema: expected `{expected}`, found `{found}`")]
    Schema {
        /// The file's name.
        file: String,
        /// The schema that is read here.
        expected: &'static str,
        /// The schema the file names.
        found: String,
    },
    /// A mapping whose knots do not rise.
    #[error("{file}: placement `{placement}`, {channel}: {problem}")]
    Knots {
        /// The file's name.
        file: String,
        /// The placement's name.
        placement: String,
        /// accel_x to gyro_z.
        channel: &'static str,
        /// What is wrong.
        problem: &'static str,
    },
    /// Too little to fit something to.
    #[error("{what}: {found} samples, at least {needed} are needed")]
    TooFew {
        /// What is fitted.
        what: String,
        /// Samples that are there.
        found: usize,
        /// Samples that are needed.
        needed: usize,
    },
    /// A mesh on which no patch can be laid.
    #[error(
        "body `{body}`: fewer than three triangles without common corners around triangle {triangle}"
    )]
    NoPatch {
        /// The body.
        body: String,
        /// The site's triangle.
        triangle: u32,
    },
    /// A placement that is read at another rate than the networks know.
    #[error(
        "placement `{placement}`: {rate_hz} Hz; the networks run live at 100 Hz: set its rate_hz to 100"
    )]
    WrongRate {
        /// The placement's name.
        placement: String,
        /// Its rate, Hz.
        rate_hz: f64,
    },
    /// A network that cannot be what it is used for.
    #[error("{network} network: {problem}")]
    WrongNetwork {
        /// acceleration or angular_velocity.
        network: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// A site or pose that the body does not have.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// An effect beyond its bounds.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// Kinematics that cannot be had.
    #[error(transparent)]
    Imu(#[from] ImuError),
    /// Times that make no sense.
    #[error(transparent)]
    Spatial(#[from] SpatialError),
    /// A batch is not sound.
    #[error("batch {number}: {reason}")]
    Batch {
        /// Its number.
        number: u64,
        /// The reason.
        reason: String,
    },
    /// An option of the training is out of range.
    #[error("training options: {field}: {reason}")]
    Options {
        /// Which.
        field: &'static str,
        /// The reason.
        reason: String,
    },
    /// The loss is no number any more.
    #[error(
        "training, step {step}: loss {loss}, gradient's length {gradient_norm}: it has diverged; choose a smaller learning rate, or clip the gradient"
    )]
    Diverged {
        /// Steps taken before.
        step: u64,
        /// The loss.
        loss: f64,
        /// The gradient's length.
        gradient_norm: f64,
    },
    /// A checkpoint was written by another training.
    #[error("{}: {field} is {in_file} in the checkpoint, {wished} is asked for; ask for the same, or begin anew with another file", path.display())]
    OtherTraining {
        /// The file.
        path: PathBuf,
        /// What differs.
        field: String,
        /// There.
        in_file: String,
        /// Here.
        wished: String,
    },
    /// Burn failed.
    #[error("burn: {reason}")]
    Burn {
        /// What it says.
        reason: String,
    },
}
