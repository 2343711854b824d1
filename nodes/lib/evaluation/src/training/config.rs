//! A training's file: what is learned from, and how.

use std::path::Path;

use cromosim_learned::train::{Loss, Schedule, TrainOptions};
use cromosim_learned::{Direction, Input, NetworkShape, Turns};
use cromosim_spatial::in_plain_words;
use serde::Deserialize;

use super::engine::EngineChoice;
use crate::EvaluationError;
use crate::error::At;
use crate::training_data::DataSource;

const SCHEMA: &str = "cromosim/training/1";

/// A training's file (YAML, schema cromosim/training/1).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainingConfig {
    schema: String,
    /// What the networks see: points, residual, differences or streaming.
    pub input: Input,
    /// Sizes of the networks.
    pub network: NetworkSizes,
    /// Where pairs of motion and measured IMU come from.
    pub data: Vec<DataSource>,
    /// Subjects that are not learned from but decide when to stop.
    pub validation: Vec<String>,
    /// How windows are turned about the vertical while learning.
    pub turns: Turns,
    /// Steps, batches and the engine.
    pub training: TrainingSettings,
}

/// Sizes of the networks; their inputs, outputs and direction follow from what they see.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkSizes {
    channels: usize,
    kernel: usize,
    convolutions: usize,
    hidden: usize,
    layers: usize,
}

/// How the training runs.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainingSettings {
    /// Steps, each on one batch.
    pub steps: u64,
    /// Windows in a batch.
    pub windows: usize,
    learning_rate: f64,
    validate_every: u64,
    patience: u64,
    /// Seed of weights, batches, devices and people.
    pub seed: u64,
    /// What computes the gradients.
    #[serde(default)]
    pub engine: EngineChoice,
}

impl TrainingConfig {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, or that is not sound.
    pub fn read(path: &Path) -> Result<Self, EvaluationError> {
        let file = || path.display().to_string();
        let text = cromosim_spatial::read_text(path).map_err(|source| EvaluationError::Read {
            path: path.to_owned(),
            source,
        })?;
        let config: Self =
            serde_norway::from_str(&text).map_err(|error| EvaluationError::Yaml {
                file: file(),
                problem: in_plain_words(error),
            })?;
        if config.schema != SCHEMA {
            return Err(EvaluationError::Schema {
                file: file(),
                expected: SCHEMA,
                found: config.schema,
            });
        }
        for source in &config.data {
            source.check().at(file)?;
        }
        if let Some(unknown) = config
            .validation
            .iter()
            .find(|subject| !config.data.iter().any(|source| source.subject == **subject))
        {
            return Err(EvaluationError::NoSuchSubject {
                file: file(),
                subject: unknown.clone(),
            });
        }
        config.options().check(&config.shape()).at(file)?;
        Ok(config)
    }

    /// The networks' shape.
    pub fn shape(&self) -> NetworkShape {
        let NetworkSizes {
            channels,
            kernel,
            convolutions,
            hidden,
            layers,
        } = self.network;
        let direction = if self.input == Input::Streaming {
            Direction::Forward
        } else {
            Direction::Both
        };
        NetworkShape {
            inputs: self.input.channels(),
            channels,
            kernel,
            convolutions,
            hidden,
            layers,
            direction,
            outputs: 3,
        }
    }

    /// The training's options.
    pub fn options(&self) -> TrainOptions {
        let TrainingSettings {
            steps,
            learning_rate,
            validate_every,
            patience,
            seed,
            ..
        } = self.training;
        TrainOptions {
            losses: vec![Loss::Huber { delta: 1.0 }],
            learning_rate,
            schedule: Schedule::Cosine { floor: 0.02 },
            clip: Some(1.0),
            steps,
            validate_every,
            patience: Some(patience),
            checkpoint_every: validate_every,
            seed,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn files_that_come_with_the_suite_are_sound() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../config/training");
        let mut count = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let config = TrainingConfig::read(&entry.unwrap().path()).unwrap();
            assert!(
                config
                    .data
                    .iter()
                    .any(|source| !config.validation.contains(&source.subject))
            );
            count += 1;
        }
        assert_eq!(count, 6);
    }
}
