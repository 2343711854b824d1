//! Networks that learn the gap between simulated and real IMUs: inference over windows, step by step, and training.

mod error;
pub mod kernels;
mod layers;
mod network;
mod shape;
mod streaming;
mod weights;

pub use error::LearnedError;
pub use network::{Network, PreparedNetwork};
pub use shape::{Direction, MOST_PARAMETERS, NetworkShape, Tensor};
pub use streaming::{StreamingBatch, StreamingNetwork};
