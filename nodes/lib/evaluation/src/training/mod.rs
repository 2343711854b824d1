//! Trainings of the networks that simulate IMUs: their file (schema cromosim/training/1), what they
//! leave in a folder, and the card of a model.

mod card;
mod config;
mod engine;
mod history;
mod run;

pub use card::data_summary;
pub use config::{NetworkSizes, TrainingConfig, TrainingSettings};
pub use engine::EngineChoice;
pub use run::{Learnt, TrainingRun};
