//! The loop.

use std::path::Path;

use super::adam::clip;
use super::batch::Batches;
use super::engine::Engine;
use super::state::{Best, Training};
use crate::LearnedError;

/// What is learned from, and what it is judged by.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    /// Step n takes batch n.
    pub training: &'a dyn Batches,
    /// Batches 0 to the number; none: no validation, and the last weights are the best.
    pub validation: Option<(&'a dyn Batches, u64)>,
}

/// Where a training stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Steps taken.
    pub step: u64,
    /// Of all steps.
    pub steps: u64,
    /// Loss of the step's batch, before the step.
    pub loss: f64,
    /// Length of its gradient, before clipping.
    pub gradient_norm: f64,
    /// Its learning rate.
    pub learning_rate: f64,
    /// Loss over the validation batches, where this step ended with one.
    pub validation_loss: Option<f64>,
    /// The least so far.
    pub best_loss: Option<f64>,
}

/// What a training tells, and how it is told to stop.
pub struct Hooks<'a> {
    /// Called after every step.
    pub progress: &'a mut dyn FnMut(&Progress),
    /// Asked after every step; once it says yes, the training stops with a checkpoint.
    pub interrupted: &'a dyn Fn() -> bool,
    /// Where checkpoints go.
    pub checkpoint: Option<&'a Path>,
}

/// Why a training stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// All steps are taken.
    Done,
    /// No better validation for as long as the options' patience.
    Early,
    /// It was interrupted; with a checkpoint it can go on.
    Interrupted,
}

impl Training {
    /// Takes steps until they are done, until it stops early, or until it is interrupted.
    ///
    /// # Errors
    /// Where a batch is not sound, where loss or gradient is no number any more (the checkpoint
    /// stays as it was), where the engine fails, or where a checkpoint cannot be written.
    pub fn run(
        &mut self,
        engine: &mut dyn Engine,
        data: Data<'_>,
        hooks: &mut Hooks<'_>,
    ) -> Result<Stop, LearnedError> {
        let mut gradients = vec![0.0; self.network.parameters().len()];
        loop {
            if let Some(stop) = self.reason_to_stop(hooks) {
                self.checkpoint(hooks)?;
                return Ok(stop);
            }
            let mut progress = self.take_step(engine, data.training, &mut gradients)?;
            if let Some((batches, count)) = data.validation
                && (self.step.is_multiple_of(self.options.validate_every)
                    || self.step == self.options.steps)
            {
                progress.validation_loss = Some(self.validate(engine, batches, count)?);
            }
            progress.best_loss = self.best.as_ref().map(|best| best.loss);
            if self.step.is_multiple_of(self.options.checkpoint_every) {
                self.checkpoint(hooks)?;
            }
            (hooks.progress)(&progress);
        }
    }

    fn reason_to_stop(&self, hooks: &Hooks<'_>) -> Option<Stop> {
        if self.step >= self.options.steps {
            Some(Stop::Done)
        } else if self
            .options
            .patience
            .is_some_and(|patience| self.stale >= patience)
        {
            Some(Stop::Early)
        } else {
            (hooks.interrupted)().then_some(Stop::Interrupted)
        }
    }

    fn checkpoint(&self, hooks: &Hooks<'_>) -> Result<(), LearnedError> {
        hooks.checkpoint.map_or(Ok(()), |path| self.write(path))
    }

    fn take_step(
        &mut self,
        engine: &mut dyn Engine,
        batches: &dyn Batches,
        gradients: &mut [f32],
    ) -> Result<Progress, LearnedError> {
        let batch = batches.batch(self.step)?;
        batch.check(self.network.shape(), self.step)?;
        let loss = engine.gradients(&self.network, &batch, &self.options.losses, gradients)?;
        let gradient_norm = clip(gradients, self.options.clip);
        if !loss.is_finite() || !gradient_norm.is_finite() {
            return Err(LearnedError::Diverged {
                step: self.step,
                loss,
                gradient_norm,
            });
        }
        let learning_rate = self.options.rate(self.step);
        self.step += 1;
        self.adam.step(
            self.network.parameters_mut(),
            gradients,
            learning_rate,
            self.step,
        );
        let steps = self.options.steps;
        Ok(Progress {
            step: self.step,
            steps,
            loss,
            gradient_norm,
            learning_rate,
            validation_loss: None,
            best_loss: None,
        })
    }

    fn validate(
        &mut self,
        engine: &mut dyn Engine,
        batches: &dyn Batches,
        count: u64,
    ) -> Result<f64, LearnedError> {
        let (mut sum, mut weight) = (0.0, 0.0);
        for number in 0..count {
            let batch = batches.batch(number)?;
            batch.check(self.network.shape(), number)?;
            sum += engine.loss_sum(&self.network, &batch, &self.options.losses)?;
            weight += batch.total_weight();
        }
        let loss = sum / (weight * self.network.shape().outputs as f64);
        if !loss.is_finite() {
            return Err(LearnedError::Diverged {
                step: self.step,
                loss,
                gradient_norm: f64::NAN,
            });
        }
        if self.best.as_ref().is_none_or(|best| loss < best.loss) {
            self.best = Some(Best {
                network: self.network.clone(),
                step: self.step,
                loss,
            });
            self.stale = 0;
        } else {
            self.stale += 1;
        }
        Ok(loss)
    }
}

#[cfg(test)]
#[path = "training_tests.rs"]
mod tests;
