//! A classifier's layers, forward and backward, on one thread.

use std::collections::BTreeMap;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::ClassifierShape;
use crate::kernels::{Linear, Padding, swap_leading_axes};
use crate::network::{check_input, initial_weights};
use crate::shape::Places;
use crate::stacks::{Convolutions, Recurrent, RecurrentTape, linear_backward, linear_of};
use crate::weights::{read_weights, weights_to_bytes};
use crate::{LearnedError, tensors};

/// Windows that go through at a time.
const BATCH: usize = 64;

/// A DeepConvLSTM; the weights lie in one vector, in the order of [`ClassifierShape::tensors`].
#[derive(Debug, Clone, PartialEq)]
pub struct Classifier {
    shape: ClassifierShape,
    pub(super) parameters: Vec<f32>,
}

impl Classifier {
    /// Initial weights from a seed, as [`crate::Network::new`] has them.
    ///
    /// # Errors
    /// Where the shape is not sound.
    pub fn new(shape: ClassifierShape, seed: u64) -> Result<Self, LearnedError> {
        shape.check()?;
        let parameters = initial_weights(&shape.tensors(), seed);
        Ok(Self { shape, parameters })
    }

    /// Its shape.
    #[must_use]
    pub fn shape(&self) -> &ClassifierShape {
        &self.shape
    }

    /// All weights.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// One number a class: (windows, steps, inputs) -> (windows, classes); the largest is the class
    /// that it says.
    ///
    /// # Errors
    /// Where the input's length does not fit, or windows are too short.
    pub fn logits(
        &self,
        windows: &[f32],
        count: usize,
        steps: usize,
    ) -> Result<Vec<f32>, LearnedError> {
        check_input(windows, count, steps, self.shape.inputs)?;
        self.check_steps(steps)?;
        let layers = Layers::new(&self.shape, &self.parameters);
        let parts = windows.chunks(BATCH * steps * self.shape.inputs);
        Ok(parts
            .flat_map(|part| layers.forward(part, steps, None).0)
            .collect())
    }

    /// The class with the largest number, for each window; the first of equals.
    ///
    /// # Errors
    /// As [`Classifier::logits`].
    pub fn classes(
        &self,
        windows: &[f32],
        count: usize,
        steps: usize,
    ) -> Result<Vec<u8>, LearnedError> {
        let logits = self.logits(windows, count, steps)?;
        let largest = |row: &[f32]| {
            (1..row.len()).fold(
                0,
                |best, class| if row[class] > row[best] { class } else { best },
            ) as u8
        };
        Ok(logits
            .chunks_exact(self.shape.classes)
            .map(largest)
            .collect())
    }

    pub(super) fn check_steps(&self, steps: usize) -> Result<(), LearnedError> {
        let least = self.shape.least_steps();
        if steps < least {
            return Err(LearnedError::Shape {
                field: "steps of a window",
                found: steps,
                least,
                most: usize::MAX,
            });
        }
        Ok(())
    }

    /// The bytes of a safetensors file; notes: whatever is to stand beside the weights.
    ///
    /// # Errors
    /// Where they cannot be made; the message names `path`, under which they are meant to lie.
    pub fn to_bytes(
        &self,
        notes: &BTreeMap<String, String>,
        path: &Path,
    ) -> Result<Vec<u8>, LearnedError> {
        weights_to_bytes(
            (&self.shape, self.shape.tensors()),
            &self.parameters,
            notes,
            path,
        )
    }

    /// Writes a safetensors file, whole or not at all.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write(&self, path: &Path, notes: &BTreeMap<String, String>) -> Result<(), LearnedError> {
        tensors::write_whole(path, &self.to_bytes(notes, path)?)
    }

    /// Reads what [`Classifier::write`] wrote, or PyTorch under the same names; `path` stands in
    /// messages. What is allocated is bounded by the bytes' length.
    ///
    /// # Errors
    /// Where the bytes are not such a file, or its tensors are not those of the shape in its
    /// metadata.
    pub fn from_bytes(
        bytes: &[u8],
        path: &Path,
    ) -> Result<(Self, BTreeMap<String, String>), LearnedError> {
        let sound = |shape: &ClassifierShape| shape.check().map(|()| shape.tensors());
        let (shape, parameters, notes) = read_weights(bytes, path, sound)?;
        Ok((Self { shape, parameters }, notes))
    }

    /// As [`Classifier::from_bytes`], from a file.
    ///
    /// # Errors
    /// Where the file cannot be read, too.
    pub fn read(path: &Path) -> Result<(Self, BTreeMap<String, String>), LearnedError> {
        Self::from_bytes(&tensors::read_bounded(path, 1)?, path)
    }
}

/// The layers with their weights packed.
pub(super) struct Layers<'a> {
    shape: &'a ClassifierShape,
    places: Places,
    convolutions: Convolutions,
    recurrent: Recurrent,
    linear: Linear,
}

/// What the way forward leaves for the way back.
#[derive(Default)]
pub(super) struct Tape {
    convolved: Vec<Vec<f32>>,
    recurrent: RecurrentTape,
    /// What went into the linear layer, and what each of its numbers was multiplied with.
    last: Vec<f32>,
    kept: Vec<f32>,
    steps_out: usize,
}

/// What is left out of the last hidden state while training.
pub(super) struct Dropout<'a> {
    pub probability: f32,
    pub random: &'a mut ChaCha8Rng,
}

impl<'a> Layers<'a> {
    pub fn new(shape: &'a ClassifierShape, parameters: &[f32]) -> Self {
        let places = shape.places();
        Self {
            shape,
            convolutions: Convolutions::new(&places, parameters, shape.kernel, Padding::None),
            recurrent: Recurrent::new(&places, parameters),
            linear: linear_of(&places, parameters),
            places,
        }
    }

    /// windows: (batch, steps, inputs) -> (batch, classes), and with dropout what the way back
    /// needs.
    ///
    /// (steps, batch, inputs) is (steps, batch x inputs, 1) in memory: a convolution over batch x
    /// inputs sequences of one number does each channel by itself, and its output (steps, batch x
    /// inputs, maps) is the LSTM's input (steps, batch, inputs x maps).
    pub fn forward(
        &self,
        windows: &[f32],
        steps: usize,
        dropout: Option<Dropout<'_>>,
    ) -> (Vec<f32>, Tape) {
        let ClassifierShape { inputs, hidden, .. } = *self.shape;
        let batch = windows.len() / (steps * inputs);
        let by_steps = swap_leading_axes(windows, batch, steps, inputs);
        let mut tape = Tape {
            steps_out: steps + 1 - self.shape.least_steps(),
            ..Tape::default()
        };
        let keep = dropout.is_some();
        let convolved = self.convolutions.forward(
            by_steps,
            batch * inputs,
            keep.then_some(&mut tape.convolved),
        );
        let recurrent =
            self.recurrent
                .forward(convolved, batch, keep.then_some(&mut tape.recurrent));
        tape.last = recurrent[(tape.steps_out - 1) * batch * hidden..].to_vec();
        if let Some(Dropout {
            probability,
            random,
        }) = dropout
        {
            let scale = 1.0 / (1.0 - probability);
            tape.kept = tape
                .last
                .iter()
                .map(|_| {
                    if random.random::<f32>() < probability {
                        0.0
                    } else {
                        scale
                    }
                })
                .collect();
            tape.last
                .iter_mut()
                .zip(&tape.kept)
                .for_each(|(value, kept)| *value *= kept);
        }
        (self.linear.forward(&tape.last), tape)
    }

    /// Adds the gradients of all parameters to `gradients`; output_gradient: (batch, classes).
    /// Returns the input's, (steps, batch, inputs).
    pub fn backward(
        &self,
        parameters: &[f32],
        tape: &Tape,
        output_gradient: &[f32],
        gradients: &mut [f32],
    ) -> Vec<f32> {
        let batch = output_gradient.len() / self.shape.classes;
        let mut of_last = linear_backward(
            &self.linear,
            &self.places,
            parameters,
            (&tape.last, output_gradient),
            gradients,
        );
        of_last
            .iter_mut()
            .zip(&tape.kept)
            .for_each(|(gradient, kept)| *gradient *= kept);
        let mut of_recurrent = vec![0.0; (tape.steps_out - 1) * of_last.len()];
        of_recurrent.extend(of_last);
        let of_convolved = self.recurrent.backward(
            &self.places,
            parameters,
            &tape.recurrent,
            of_recurrent,
            gradients,
        );
        let convolved = (tape.convolved.as_slice(), tape.recurrent.input());
        self.convolutions.backward(
            &self.places,
            parameters,
            convolved,
            of_convolved,
            batch * self.shape.inputs,
            gradients,
        )
    }
}

/// The random numbers of a training.
pub(super) fn random(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    random
}

#[cfg(test)]
#[path = "network_tests.rs"]
mod tests;
