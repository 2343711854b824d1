//! What a classifier looks like, and where its weights lie.

use serde::{Deserialize, Serialize};

use crate::LearnedError;
use crate::shape::{Places, Tensor, TensorList, check};

/// A DeepConvLSTM: (batch, steps, inputs) -> (batch, classes).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassifierShape {
    /// Channels of a window.
    pub inputs: usize,
    /// Feature maps of every convolution, for each channel.
    pub maps: usize,
    /// Taps of every convolution.
    pub kernel: usize,
    /// Convolutions.
    pub convolutions: usize,
    /// Hidden units of an LSTM layer.
    pub hidden: usize,
    /// LSTM layers.
    pub layers: usize,
    /// Classes.
    pub classes: usize,
}

impl ClassifierShape {
    /// The sizes of the article: 64 maps, four convolutions of 5 taps, two layers of 128 units.
    #[must_use]
    pub fn published(inputs: usize, classes: usize) -> Self {
        Self {
            inputs,
            maps: 64,
            kernel: 5,
            convolutions: 4,
            hidden: 128,
            layers: 2,
            classes,
        }
    }

    /// All numbers within their ranges, and no more parameters than [`crate::MOST_PARAMETERS`].
    ///
    /// # Errors
    /// Where they are not; the message names the number.
    pub fn check(&self) -> Result<(), LearnedError> {
        let numbers = [
            ("inputs", self.inputs, 1, 65_536),
            ("maps", self.maps, 1, 4_096),
            ("kernel", self.kernel, 1, 255),
            ("convolutions", self.convolutions, 1, 64),
            ("hidden", self.hidden, 1, 16_384),
            ("layers", self.layers, 1, 64),
            ("classes", self.classes, 2, 65_536),
        ];
        check(&numbers, || self.tensors())
    }

    /// Steps that a window must have at least, so that one is left behind the convolutions.
    #[must_use]
    pub fn least_steps(&self) -> usize {
        self.convolutions * (self.kernel - 1) + 1
    }

    /// Every tensor by PyTorch's names of the modules `conv` (Conv1d over one channel), `lstm` and
    /// `linear`, in the order in which they lie.
    #[must_use]
    pub fn tensors(&self) -> Vec<Tensor> {
        let mut list = TensorList::default();
        list.convolutions(1, self.maps, self.kernel, self.convolutions);
        list.recurrent(self.inputs * self.maps, self.hidden, self.layers, 1);
        list.linear(self.hidden, self.classes);
        list.0
    }

    /// All parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.tensors().last().map_or(0, |tensor| tensor.range.end)
    }

    pub(super) fn places(&self) -> Places {
        Places::from_tensors(self.tensors(), self.convolutions, self.layers, 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_as_pytorch_does() {
        let shape = ClassifierShape::published(12, 5);
        let convolutions = (64 * 5 + 64) + 3 * (64 * 64 * 5 + 64);
        let lstm = 512 * (12 * 64 + 128) + 1024 + 512 * (128 + 128) + 1024;
        assert_eq!(shape.parameters(), convolutions + lstm + 128 * 5 + 5);
        assert_eq!(shape.least_steps(), 17);
        assert!(shape.check().is_ok());
    }

    #[test]
    fn refuses_what_cannot_be() {
        let message = |shape: ClassifierShape| shape.check().unwrap_err().to_string();
        let shape = ClassifierShape::published(12, 5);
        assert_eq!(
            message(ClassifierShape {
                classes: 1,
                ..shape.clone()
            }),
            "network shape: classes is 1, it may be 2 to 65536"
        );
        assert!(
            message(ClassifierShape {
                hidden: 16_384,
                ..shape
            })
            .contains("parameters, at most 268435456")
        );
    }
}
