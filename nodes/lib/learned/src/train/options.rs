//! How a training runs.

use serde::{Deserialize, Serialize};

use super::loss::Loss;
use crate::{LearnedError, NetworkShape};

/// How the learning rate goes over the steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Schedule {
    /// The same all the time.
    Constant,
    /// Half a cosine from the learning rate down to `floor` times it, over all steps (Loshchilov
    /// and Hutter 2017, without restarts).
    Cosine {
        /// What is left at the end, 0 to 1.
        floor: f64,
    },
}

impl Schedule {
    /// The learning rate of a step, from 0 on, of so many steps.
    #[must_use]
    pub fn rate(self, learning_rate: f64, step: u64, steps: u64) -> f64 {
        match self {
            Self::Constant => learning_rate,
            Self::Cosine { floor } => {
                let share = step.min(steps) as f64 / steps as f64;
                learning_rate
                    * (floor + (1.0 - floor) * 0.5 * (1.0 + (std::f64::consts::PI * share).cos()))
            }
        }
    }
}

/// How a training runs; all of it stands in a checkpoint, and a training goes on only with the
/// same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainOptions {
    /// One loss for all outputs, or one each.
    pub losses: Vec<Loss>,
    /// Of Adam.
    pub learning_rate: f64,
    /// How it goes.
    pub schedule: Schedule,
    /// The most that the gradient's length may be; longer ones are shortened.
    pub clip: Option<f64>,
    /// Steps, one batch each.
    pub steps: u64,
    /// Steps between validations.
    pub validate_every: u64,
    /// Stops after so many validations without a better one.
    pub patience: Option<u64>,
    /// Steps between checkpoints, where a file is named.
    pub checkpoint_every: u64,
    /// Of the initial weights; batches have theirs from their maker.
    pub seed: u64,
}

impl TrainOptions {
    /// All within their ranges.
    ///
    /// # Errors
    /// Where they are not; the message names the field.
    pub fn check(&self, shape: &NetworkShape) -> Result<(), LearnedError> {
        let wrong =
            |field: &'static str, reason: String| Err(LearnedError::Options { field, reason });
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if self.losses.len() != 1 && self.losses.len() != shape.outputs {
            return wrong(
                "losses",
                format!(
                    "{} of them; one for all outputs or {} are needed",
                    self.losses.len(),
                    shape.outputs
                ),
            );
        }
        if let Some(Loss::Huber { delta }) = self
            .losses
            .iter()
            .find(|loss| matches!(loss, Loss::Huber { delta } if !positive(f64::from(*delta))))
        {
            return wrong(
                "losses",
                format!("huber delta is {delta}; it has to be above 0"),
            );
        }
        if !positive(self.learning_rate) {
            return wrong(
                "learning_rate",
                format!("{}; it has to be above 0", self.learning_rate),
            );
        }
        if let Schedule::Cosine { floor } = self.schedule
            && !(0.0..=1.0).contains(&floor)
        {
            return wrong("schedule", format!("floor is {floor}; it may be 0 to 1"));
        }
        if let Some(clip) = self.clip.filter(|clip| !positive(*clip)) {
            return wrong("clip", format!("{clip}; it has to be above 0"));
        }
        for (field, value) in [
            ("steps", self.steps),
            ("validate_every", self.validate_every),
            ("checkpoint_every", self.checkpoint_every),
        ] {
            if value == 0 {
                return wrong(field, "0; it has to be at least 1".to_owned());
            }
        }
        Ok(())
    }

    /// The learning rate of a step, from 0 on.
    #[must_use]
    pub fn rate(&self, step: u64) -> f64 {
        self.schedule.rate(self.learning_rate, step, self.steps)
    }
}
