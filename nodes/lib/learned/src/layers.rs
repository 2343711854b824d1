//! A network's layers in sequence, forward and backward, for a part of a batch.

use crate::kernels::{Convolution, Linear, Lstm, Padding};
use crate::shape::{Direction, NetworkShape, Places};
use crate::stacks::{Convolutions, Recurrent, RecurrentTape, linear_backward, linear_of};

/// The layers with their weights packed.
#[derive(Debug, Clone)]
pub(crate) struct Layers {
    places: Places,
    convolutions: Convolutions,
    recurrent: Recurrent,
    linear: Linear,
}

/// What the way forward leaves for the way back.
#[derive(Debug, Default)]
pub(crate) struct Tape {
    /// What went into each convolution.
    convolved: Vec<Vec<f32>>,
    recurrent: RecurrentTape,
    /// What went into the linear layer.
    last: Vec<f32>,
}

impl Layers {
    pub fn new(shape: &NetworkShape, parameters: &[f32]) -> Self {
        let places = shape.places();
        let padding = if shape.direction == Direction::Both {
            Padding::Same
        } else {
            Padding::Causal
        };
        Self {
            convolutions: Convolutions::new(&places, parameters, shape.kernel, padding),
            recurrent: Recurrent::new(&places, parameters),
            linear: linear_of(&places, parameters),
            places,
        }
    }

    /// The convolutions, the LSTM layers in forward order, the linear layer.
    pub fn parts(&self) -> (&[Convolution], impl Iterator<Item = &Lstm>, &Linear) {
        (
            self.convolutions.layers(),
            self.recurrent.layers(),
            &self.linear,
        )
    }

    /// input: (steps, batch, inputs) -> (steps, batch, outputs).
    pub fn forward(&self, input: Vec<f32>, batch: usize) -> Vec<f32> {
        self.linear.forward(&self.recurrent.forward(
            self.convolutions.forward(input, batch, None),
            batch,
            None,
        ))
    }

    /// As [`Layers::forward`], with what the way back needs.
    pub fn forward_with_tape(&self, input: Vec<f32>, batch: usize) -> (Vec<f32>, Tape) {
        let mut tape = Tape::default();
        let convolved = self
            .convolutions
            .forward(input, batch, Some(&mut tape.convolved));
        tape.last = self
            .recurrent
            .forward(convolved, batch, Some(&mut tape.recurrent));
        (self.linear.forward(&tape.last), tape)
    }

    /// Adds the gradients of all parameters to `gradients`; output_gradient: (steps, batch,
    /// outputs). Returns the input's.
    pub fn backward(
        &self,
        parameters: &[f32],
        tape: &Tape,
        output_gradient: &[f32],
        batch: usize,
        gradients: &mut [f32],
    ) -> Vec<f32> {
        let of_last = linear_backward(
            &self.linear,
            &self.places,
            parameters,
            (&tape.last, output_gradient),
            gradients,
        );
        let of_convolved = self.recurrent.backward(
            &self.places,
            parameters,
            &tape.recurrent,
            of_last,
            gradients,
        );
        let convolved = (tape.convolved.as_slice(), tape.recurrent.input());
        self.convolutions.backward(
            &self.places,
            parameters,
            convolved,
            of_convolved,
            batch,
            gradients,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Network;
    use crate::kernels::testing::{check_gradient, values, weighted_sum};

    #[test]
    fn gradients_of_a_whole_network_agree_with_differences() {
        for (direction, convolutions, layers) in [
            (Direction::Both, 2, 2),
            (Direction::Forward, 1, 2),
            (Direction::Both, 0, 1),
        ] {
            let shape = NetworkShape {
                inputs: 3,
                channels: 4,
                kernel: 3,
                convolutions,
                hidden: 5,
                layers,
                direction,
                outputs: 2,
            };
            let (steps, batch) = (4, 2);
            let network = Network::new(shape.clone(), 7).unwrap();
            let (input, along) = (values(steps * batch * 3, 1), values(steps * batch * 2, 2));
            let loss = |parameters: &[f32], input: &[f32]| {
                weighted_sum(
                    &Layers::new(&shape, parameters).forward(input.to_vec(), batch),
                    &along,
                )
            };
            let layers = Layers::new(&shape, network.parameters());
            let (_, tape) = layers.forward_with_tape(input.clone(), batch);
            let mut gradients = vec![0.0; network.parameters().len()];
            let of_input =
                layers.backward(network.parameters(), &tape, &along, batch, &mut gradients);
            check_gradient(
                "parameters",
                network.parameters(),
                &gradients,
                |parameters| loss(parameters, &input),
            );
            check_gradient("input", &input, &of_input, |input| {
                loss(network.parameters(), input)
            });
        }
    }
}
