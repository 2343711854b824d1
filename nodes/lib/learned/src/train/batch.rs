//! What a network learns from.

use crate::{LearnedError, NetworkShape};

/// Sequences of equal length with what is to come out of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// (sequences, steps, inputs)
    pub inputs: Vec<f32>,
    /// (sequences, steps, outputs); where the weight is 0, anything, NaN included.
    pub targets: Vec<f32>,
    /// How much each step counts, not negative, (sequences, steps); 0 leaves it out.
    pub weights: Vec<f32>,
    /// Sequences.
    pub sequences: usize,
    /// Steps of each.
    pub steps: usize,
}

/// Batches by their number: the same number gives the same batch, so that a training that was
/// interrupted goes on as if it were not. Whatever is random in them follows from a seed and the
/// number.
pub trait Batches: Sync {
    /// The batch of this number, from 0 on.
    ///
    /// # Errors
    /// Where it cannot be made.
    fn batch(&self, number: u64) -> Result<Batch, LearnedError>;
}

impl Batch {
    /// The sum of all weights.
    #[must_use]
    pub fn total_weight(&self) -> f64 {
        self.weights.iter().map(|weight| f64::from(*weight)).sum()
    }

    /// Lengths fit the network, inputs are finite, and so are weights and the targets that count;
    /// number: for the message.
    ///
    /// # Errors
    /// Where they are not.
    pub fn check(&self, shape: &NetworkShape, number: u64) -> Result<(), LearnedError> {
        let wrong = |reason: String| Err(LearnedError::Batch { number, reason });
        let rows = self.sequences.saturating_mul(self.steps);
        let lengths = [
            ("inputs", self.inputs.len(), shape.inputs),
            ("targets", self.targets.len(), shape.outputs),
            ("weights", self.weights.len(), 1),
        ];
        for (what, found, width) in lengths {
            if rows == 0 || found != rows.saturating_mul(width) {
                return wrong(format!(
                    "{} sequences x {} steps x {width} {what} are not the {found} there are",
                    self.sequences, self.steps
                ));
            }
        }
        if let Some(index) = self.inputs.iter().position(|value| !value.is_finite()) {
            return wrong(format!(
                "input {index} is {}; weigh gaps with 0 and fill them",
                self.inputs[index]
            ));
        }
        for (row, (weight, targets)) in self
            .weights
            .iter()
            .zip(self.targets.chunks_exact(shape.outputs))
            .enumerate()
        {
            if !(weight.is_finite() && *weight >= 0.0) {
                return wrong(format!(
                    "weight {row} is {weight}; weights are finite and not negative"
                ));
            }
            if *weight > 0.0 && !targets.iter().all(|target| target.is_finite()) {
                return wrong(format!(
                    "row {row} counts, but its targets are {targets:?}; weigh it with 0"
                ));
            }
        }
        if self.weights.iter().all(|weight| *weight == 0.0) {
            return wrong("all weights are 0".to_owned());
        }
        Ok(())
    }
}
