//! A training in a folder: checkpoints to go on from, losses, weights and the card.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use cromosim_learned::train::{Data, Engine, Hooks, Progress, Stop, Training};
use cromosim_learned::{LearnedSimulator, Network, Pair, PairBatches, Quantity, Windows};

use super::card;
use super::config::TrainingConfig;
use super::history::History;
use crate::EvaluationError;
use crate::error::At;
use crate::observer::Observer;
use crate::seeds::mixed_seed;

/// A training and the folder that it works in.
pub struct TrainingRun<'a> {
    /// What is trained, and how.
    pub config: &'a TrainingConfig,
    /// Where weights, card.md, losses and checkpoints are written; it has to exist.
    pub out: &'a Path,
    /// Begins anew where `out` holds a training already, rather than to go on with it.
    pub begin_anew: bool,
    /// Pairs that are learned from.
    pub training: &'a [Pair],
    /// Pairs that decide when to stop.
    pub validation: &'a [Pair],
}

/// What came of a network's training.
pub enum Learnt {
    /// A trained network.
    Network {
        /// The network with the best validation loss.
        network: Network,
        /// Steps that were taken.
        steps: u64,
        /// The step after which the validation loss was best.
        best_step: u64,
        /// The best validation loss, in the network's own units.
        best_loss: f64,
    },
    /// The observer asked for the end; the training goes on from the checkpoint.
    Interrupted {
        /// The checkpoint.
        checkpoint: PathBuf,
    },
}

impl TrainingRun<'_> {
    /// Copies the training's file to `out`/training.yaml. A folder that was begun with another file
    /// is refused, since its weights would not be what their card says.
    ///
    /// # Errors
    /// [`EvaluationError::OtherConfiguration`], and files that cannot be read or written.
    pub fn keep_configuration(&self, file: &Path) -> Result<(), EvaluationError> {
        let kept = self.out.join("training.yaml");
        let text = fs::read(file).map_err(|source| EvaluationError::Read {
            path: file.to_owned(),
            source,
        })?;
        if !self.begin_anew && fs::read(&kept).is_ok_and(|begun_with| begun_with != text) {
            return Err(EvaluationError::OtherConfiguration {
                kept,
                given: file.to_owned(),
            });
        }
        fs::write(&kept, text).map_err(|source| EvaluationError::Write { path: kept, source })
    }

    /// Trains one network, from its checkpoint on where there is one.
    ///
    /// # Errors
    /// Pairs that make no batch, checkpoints of another training, divergence, files that cannot be
    /// written.
    pub fn learn(
        &self,
        engine: &mut dyn Engine,
        quantity: Quantity,
        observer: &dyn Observer,
    ) -> Result<Learnt, EvaluationError> {
        let turned = Windows::Drawn {
            seed: mixed_seed(&[self.config.training.seed, quantity as u64]),
            turns: self.config.turns,
        };
        let training = self.batches(self.training, quantity, turned, "training")?;
        let validation = self.batches(self.validation, quantity, Windows::InOrder, "validation")?;
        let checkpoint = self.out.join(format!("{}.checkpoint", quantity.name()));
        let (shape, options) = (self.config.shape(), self.config.options());
        let mut state = if self.begin_anew {
            Training::new(shape, options)?
        } else {
            Training::resume_or_new(&checkpoint, shape, options)?
        };
        let history = format!("{}_history.csv", quantity.name());
        let mut history = History::open(self.out.join(history), state.step())?;
        observer.begin(quantity.name(), self.config.training.steps);
        let mut told = state.step();
        observer.advance(told);
        let mut failure = None;
        let mut tell = |progress: &Progress| {
            observer.advance(progress.step.saturating_sub(told));
            told = progress.step;
            if let Some(loss) = progress.validation_loss {
                observer.describe(&format!("{} {loss:.4}", quantity.name()));
                failure = failure.take().or_else(|| history.add(progress).err());
            }
        };
        let data = Data {
            training: &training,
            validation: Some((&validation, validation.count())),
        };
        let mut hooks = Hooks {
            progress: &mut tell,
            interrupted: &|| observer.interrupted(),
            checkpoint: Some(&checkpoint),
        };
        let stop = state.run(engine, data, &mut hooks)?;
        observer.end();
        if let Some(error) = failure {
            return Err(error);
        }
        if stop == Stop::Interrupted {
            return Ok(Learnt::Interrupted { checkpoint });
        }
        Ok(Learnt::Network {
            steps: state.step(),
            best_step: state.best().map_or(state.step(), |best| best.step),
            best_loss: state.best().map_or(f64::NAN, |best| best.loss),
            network: state.into_network(),
        })
    }

    fn batches<'a>(
        &self,
        pairs: &'a [Pair],
        quantity: Quantity,
        windows: Windows,
        what: &str,
    ) -> Result<PairBatches<'a>, EvaluationError> {
        let per_batch = self.config.training.windows;
        PairBatches::new(pairs, self.config.input, quantity, per_batch, windows)
            .at(|| what.to_owned())
    }

    /// Writes the weights and card.md, and gives the table of the scores on the validation pairs.
    ///
    /// # Errors
    /// Networks that do not go together, and files that cannot be written.
    pub fn finish(&self, networks: [Network; 2]) -> Result<String, EvaluationError> {
        let simulator = LearnedSimulator::new(self.config.input, networks)?;
        let scores = card::scores(&simulator, self.validation)?;
        let text = card::text(
            self.config,
            &simulator,
            [self.training, self.validation],
            &scores,
        );
        simulator.write(self.out, &self.notes())?;
        let path = self.out.join("card.md");
        fs::write(&path, &text).map_err(|source| EvaluationError::Write { path, source })?;
        Ok(scores)
    }

    /// Notes in the weights' files.
    fn notes(&self) -> BTreeMap<String, String> {
        let mut licences: Vec<&str> = self
            .config
            .data
            .iter()
            .map(|source| source.licence.as_str())
            .collect();
        licences.sort_unstable();
        licences.dedup();
        BTreeMap::from([
            ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("licences of the data".to_owned(), licences.join("; ")),
        ])
    }
}
