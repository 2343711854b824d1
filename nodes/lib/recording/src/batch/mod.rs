//! Many motion files at once: which they are, which of them a machine of several takes, and which
//! are done.
//!
//! A [`Manifest`] beside the outputs says with which settings they were made and what became of
//! each input, so that a second run does what is missing. It holds no times: the same inputs give
//! the same bytes.

mod inputs;
mod manifest;
mod shard;

pub use inputs::{BatchInput, expand, is_of_many};
pub use manifest::{Manifest, Outcome};
pub use shard::Shard;
