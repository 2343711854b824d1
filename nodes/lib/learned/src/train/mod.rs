//! Training: batches by number, a masked loss, Adam, validation, early stopping, checkpoints from
//! which it goes on to the same bits.

pub(crate) mod adam;
mod batch;
mod checkpoint;
mod engine;
mod loss;
mod options;
mod state;
mod training;

pub use batch::{Batch, Batches};
pub use engine::{Engine, KernelEngine};
pub use loss::Loss;
#[cfg(feature = "burn")]
pub(crate) use loss::weighted_loss;
pub use options::{Schedule, TrainOptions};
pub use state::{Best, Training};
pub use training::{Data, Hooks, Progress, Stop};
