//! The crate's one error type.

use std::error::Error;
use std::net::SocketAddr;
use std::path::PathBuf;

/// What can go wrong when a recording is opened, written or finished.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The file cannot be created.
    #[error("{}: cannot create the recording ({source}); check that the folder exists and can be written", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The operating system's or the encoder's reason.
        source: Box<dyn Error + Send + Sync>,
    },
    /// No viewer listens at the address.
    #[error(
        "{address}: no Rerun viewer answers ({source}); start one with `rerun --bind 127.0.0.1`, or write a file"
    )]
    NoViewer {
        /// Where the viewer was looked for.
        address: SocketAddr,
        /// Why the connection failed.
        source: std::io::Error,
    },
    /// Recorded data did not reach its destination: the disk is full, or the viewer went away.
    #[error(
        "{destination}: recorded data was lost ({reason}); what was written before is kept; check the free space, or whether the viewer still runs"
    )]
    Lost {
        /// The file or address.
        destination: String,
        /// The sink's reason.
        reason: String,
    },
    /// An option is outside its range.
    #[error("{option}: expected {expected}, found {found}")]
    Option {
        /// The option's name.
        option: &'static str,
        /// What is allowed.
        expected: &'static str,
        /// What was given.
        found: String,
    },
    /// A face names a vertex that the mesh lacks.
    #[error("face {face}: vertex {vertex} is not one of the {vertex_count} vertices")]
    Face {
        /// Index of the face.
        face: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        vertex_count: usize,
    },
    /// A list has the wrong length.
    #[error("{what}: expected {expected}, found {found}")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// The Rerun SDK refused.
    #[error("the Rerun SDK refused ({0})")]
    Sdk(#[source] Box<dyn Error + Send + Sync>),
}

impl From<re_sdk::RecordingStreamError> for ViewError {
    fn from(error: re_sdk::RecordingStreamError) -> Self {
        Self::Sdk(Box::new(error))
    }
}
