//! What can go wrong.

use std::io;
use std::path::PathBuf;

use cromosim_body::BodyError;
use cromosim_imu::{EffectError, ImuError};
use cromosim_spatial::{SpatialError, meant};

/// Errors of this crate; the message names the file, the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnedError {
    /// No model of this name comes with the suite.
    #[error(
        "{name}: neither a folder with networks nor a model that comes with the suite ({known}){}",
        meant(name, known.split(", "))
    )]
    UnknownModel {
        /// The name or folder that was given.
        name: String,
        /// Names of the models that come with the suite.
        known: String,
    },
    /// A number of a network's shape is out of range.
    #[error("network shape: {field} is {found}, it may be {least} to {most}")]
    Shape {
        /// Field of the shape, as in files.
        field: &'static str,
        /// The value given.
        found: usize,
        /// Least value that is allowed.
        least: usize,
        /// Greatest value that is allowed.
        most: usize,
    },
    /// The shape as a whole is too large.
    #[error(
        "network shape: {found} parameters, at most {most} are supported: choose fewer channels, hidden units or layers"
    )]
    TooLarge {
        /// Parameters that the shape has.
        found: u64,
        /// Parameters that are allowed.
        most: u64,
    },
    /// An input's length does not fit.
    #[error(
        "network input: {found} numbers, {batch} sequences x {steps} steps x {inputs} inputs are {expected}"
    )]
    Input {
        /// Numbers that were given.
        found: usize,
        /// Sequences of the batch.
        batch: usize,
        /// Steps of each sequence.
        steps: usize,
        /// Numbers of a step: the shape's `inputs`.
        inputs: usize,
        /// Product of the three.
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
        /// What the system says.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file is larger than any network of ours.
    #[error("{}: {found} bytes, weights of a network are at most {most}", path.display())]
    FileTooLarge {
        /// The file.
        path: PathBuf,
        /// Its size, bytes.
        found: u64,
        /// The largest size that is read, bytes.
        most: u64,
    },
    /// The file is not sound.
    #[error("{}: not a sound safetensors file ({reason}); write it anew", path.display())]
    Unsound {
        /// The file.
        path: PathBuf,
        /// What the reader found.
        reason: String,
    },
    /// The header lacks the network's shape, or it cannot be read.
    #[error("{}: metadata `{key}`: {reason}; it is written by `cromosim` beside the weights", path.display())]
    Metadata {
        /// The file.
        path: PathBuf,
        /// Key of the entry that is missing or not readable.
        key: &'static str,
        /// What the reader found.
        reason: String,
    },
    /// A tensor is missing.
    #[error("{}: tensor {tensor} is missing; there are: {known}", path.display())]
    TensorMissing {
        /// The file.
        path: PathBuf,
        /// Name of the tensor.
        tensor: String,
        /// Names of the tensors in the file.
        known: String,
    },
    /// A tensor that the network does not have.
    #[error("{}: tensor {tensor} is none of the network's; remove it, or correct the shape in the metadata", path.display())]
    TensorUnknown {
        /// The file.
        path: PathBuf,
        /// Name of the tensor.
        tensor: String,
    },
    /// A tensor's shape or type does not fit.
    #[error("{}: tensor {tensor}: expected F32 of shape {expected:?}, found {found_type} of shape {found:?}", path.display())]
    Tensor {
        /// The file.
        path: PathBuf,
        /// Name of the tensor.
        tensor: String,
        /// The network's shape of it, slowest axis first.
        expected: Vec<usize>,
        /// The file's shape of it.
        found: Vec<usize>,
        /// The file's type of it, as safetensors names types.
        found_type: String,
    },
    /// A weight that is not a number.
    #[error("{}: tensor {tensor}, element {index} is {value}; weights are finite", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Name of the tensor.
        tensor: String,
        /// Place among its numbers, from 0 on.
        index: usize,
        /// NaN or an infinity.
        value: f32,
    },
    /// A file that is not YAML, or has wrong or unknown fields.
    #[error("{file}: {problem}")]
    Yaml {
        /// The file's name.
        file: String,
        /// Why, with line and column.
        problem: String,
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
        /// Axis of the reading: accel_x to gyro_z.
        channel: &'static str,
        /// What its knots lack.
        problem: &'static str,
    },
    /// Too little to fit something to.
    #[error("{what}: {found} samples, at least {needed} are needed")]
    TooFew {
        /// What is to be fitted.
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
        /// Name of the body model.
        body: String,
        /// Number of the site's triangle.
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
        /// `acceleration` or `angular_velocity`.
        network: &'static str,
        /// Why it cannot be used so.
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
        /// Number of the batch.
        number: u64,
        /// Which of its lengths or values does not fit.
        reason: String,
    },
    /// An option of the training is out of range.
    #[error("training options: {field}: {reason}")]
    Options {
        /// Field of the options, as in files.
        field: &'static str,
        /// What is allowed.
        reason: String,
    },
    /// The loss is no number any more.
    #[error(
        "training, step {step}: loss {loss}, gradient's length {gradient_norm}: it has diverged; choose a smaller learning rate, or clip the gradient"
    )]
    Diverged {
        /// Steps taken before.
        step: u64,
        /// Loss of the step's batch.
        loss: f64,
        /// Length of its gradient; NaN in a validation.
        gradient_norm: f64,
    },
    /// A checkpoint was written by another training.
    #[error("{}: {field} is {in_file} in the checkpoint, {wished} is asked for; ask for the same, or begin anew with another file", path.display())]
    OtherTraining {
        /// The file.
        path: PathBuf,
        /// The first field of shape or options that differs.
        field: String,
        /// The checkpoint's value.
        in_file: String,
        /// The value that is asked for.
        wished: String,
    },
    /// Burn failed.
    #[error("burn: {reason}")]
    Burn {
        /// Burn's own message.
        reason: String,
    },
}
