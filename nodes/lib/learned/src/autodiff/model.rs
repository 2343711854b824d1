//! The network as Burn's tensors.

use ::burn::tensor::activation::{relu, sigmoid};
use ::burn::tensor::module::conv1d;
use ::burn::tensor::ops::ConvOptions;
use ::burn::tensor::{Device, Gradients, Tensor, TensorData};

use super::fused;
use crate::shape::{Direction, LstmPlace};
use crate::{LearnedError, Network, NetworkShape};

/// Every tensor of a network, flat, in its order, and what they are to be.
pub(super) struct Model<'a> {
    shape: &'a NetworkShape,
    /// Leaves of the graph, in the order of [`NetworkShape::tensors`].
    leaves: Vec<Tensor<1>>,
    fused: bool,
}

/// Weights of one layer, its directions one behind the other along the first axis.
struct Layer {
    input: Tensor<2>,
    recurrent: Tensor<2>,
    bias: Tensor<1>,
}

impl<'a> Model<'a> {
    pub fn new(network: &'a Network, device: &Device, fused: bool) -> Self {
        let leaf = |values: &[f32]| {
            let tensor =
                Tensor::<1>::from_data(TensorData::new(values.to_vec(), [values.len()]), device);
            if device.is_autodiff() {
                tensor.require_grad()
            } else {
                tensor
            }
        };
        let leaves = network
            .shape()
            .tensors()
            .into_iter()
            .map(|tensor| leaf(&network.parameters()[tensor.range]))
            .collect();
        Self {
            shape: network.shape(),
            leaves,
            fused,
        }
    }

    /// (batch, steps, inputs) -> (batch, steps, outputs)
    pub fn forward(&self, input: Tensor<3>) -> Tensor<3> {
        let mut leaves = self.leaves.iter().cloned();
        let mut next = || {
            leaves.next().unwrap_or_else(|| {
                Tensor::from_data(TensorData::new(Vec::<f32>::new(), [0]), &input.device())
            })
        };
        let (shape, [batch, steps, _]) = (self.shape, input.dims());
        let mut current = input.clone().swap_dims(1, 2);
        for _ in 0..shape.convolutions {
            let channels = current.dims()[1];
            let (weight, bias) = (
                next().reshape([shape.channels, channels, shape.kernel]),
                next(),
            );
            current = relu(conv1d(
                pad(current, shape),
                weight,
                Some(bias),
                ConvOptions::new([1], [0], [1], 1),
            ));
        }
        let mut current = current.permute([2, 0, 1]);
        for layer in &shape.places().lstm {
            let layer = self.layer(layer, &mut next);
            current = if self.fused {
                fused::lstm(current, layer.input, layer.recurrent, layer.bias)
            } else {
                composed(&current, &layer)
            };
        }
        let (wide, weight, bias) = (shape.hidden * shape.directions(), next(), next());
        let weight = weight.reshape([shape.outputs, wide]).transpose();
        let rows = current.reshape([steps * batch, wide]).matmul(weight) + bias.unsqueeze();
        rows.reshape([steps, batch, shape.outputs]).swap_dims(0, 1)
    }

    fn layer(&self, places: &[LstmPlace], next: &mut impl FnMut() -> Tensor<1>) -> Layer {
        let (hidden, inputs) = (
            self.shape.hidden,
            places
                .first()
                .map_or(0, |place| place.input.len() / (4 * self.shape.hidden)),
        );
        let (mut input, mut recurrent, mut bias) = (Vec::new(), Vec::new(), Vec::new());
        for _ in places {
            input.push(next().reshape([4 * hidden, inputs]));
            recurrent.push(next().reshape([4 * hidden, hidden]));
            bias.push(next() + next());
        }
        Layer {
            input: Tensor::cat(input, 0),
            recurrent: Tensor::cat(recurrent, 0),
            bias: Tensor::cat(bias, 0),
        }
    }

    /// Writes the leaves' gradients in their order.
    pub fn gradients(&self, found: &Gradients, gradients: &mut [f32]) -> Result<(), LearnedError> {
        for (leaf, tensor) in self.leaves.iter().zip(self.shape.tensors()) {
            let missing = || LearnedError::Burn {
                reason: format!("no gradient of {}", tensor.name),
            };
            gradients[tensor.range.clone()]
                .copy_from_slice(&numbers(leaf.grad(found).ok_or_else(missing)?)?);
        }
        Ok(())
    }
}

/// Zeros before and behind the last axis.
fn pad(values: Tensor<3>, shape: &NetworkShape) -> Tensor<3> {
    let padding = if shape.direction == Direction::Both {
        crate::kernels::Padding::Same
    } else {
        crate::kernels::Padding::Causal
    };
    let (before, behind) = padding.steps(shape.kernel);
    let ([batch, channels, _], device) = (values.dims(), values.device());
    let zeros = |steps: usize| Tensor::<3>::zeros([batch, channels, steps], &device);
    let parts = [
        (before, zeros(before)),
        (usize::MAX, values),
        (behind, zeros(behind)),
    ];
    Tensor::cat(
        parts
            .into_iter()
            .filter(|(steps, _)| *steps > 0)
            .map(|(_, part)| part)
            .collect(),
        2,
    )
}

/// An LSTM layer of Burn's own operations; (steps, batch, inputs) -> (steps, batch, directions x
/// H).
fn composed(input: &Tensor<3>, layer: &Layer) -> Tensor<3> {
    let [steps, batch, inputs] = input.dims();
    let hidden = layer.recurrent.dims()[1];
    let rows = input.clone().reshape([steps * batch, inputs]);
    let direction = |index: usize| {
        let part = |tensor: &Tensor<2>| {
            tensor
                .clone()
                .narrow(0, 4 * hidden * index, 4 * hidden)
                .transpose()
        };
        let (recurrent, bias) = (
            part(&layer.recurrent),
            layer.bias.clone().narrow(0, 4 * hidden * index, 4 * hidden),
        );
        let by_input = rows.clone().matmul(part(&layer.input)) + bias.unsqueeze();
        let (mut h, mut c) = (
            Tensor::<2>::zeros([batch, hidden], &input.device()),
            Tensor::<2>::zeros([batch, hidden], &input.device()),
        );
        let mut outputs = Vec::with_capacity(steps);
        for step in 0..steps {
            let step = if index == 0 { step } else { steps - 1 - step };
            let gates =
                by_input.clone().narrow(0, step * batch, batch) + h.matmul(recurrent.clone());
            let gate = |index: usize| gates.clone().narrow(1, index * hidden, hidden);
            c = sigmoid(gate(1)) * c + sigmoid(gate(0)) * gate(2).tanh();
            h = sigmoid(gate(3)) * c.clone().tanh();
            outputs.push(h.clone());
        }
        if index == 1 {
            outputs.reverse();
        }
        Tensor::stack::<3>(outputs, 0)
    };
    let directions = layer.recurrent.dims()[0] / (4 * hidden);
    Tensor::cat((0..directions).map(direction).collect(), 2)
}

/// The values of a tensor, in its order.
pub(super) fn numbers<const D: usize>(tensor: Tensor<D>) -> Result<Vec<f32>, LearnedError> {
    let failed = |reason: String| LearnedError::Burn { reason };
    let data = tensor
        .try_into_data()
        .map_err(|error| failed(format!("{error:?}")))?;
    data.try_into_vec::<f32>()
        .map_err(|error| failed(format!("{error:?}")))
}
