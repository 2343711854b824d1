//! The LSTM layer as one operation of Burn's CPU backend, with the backward pass of our kernels.

use std::sync::Arc;

use ::burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use ::burn::backend::autodiff::grads::Gradients;
use ::burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use ::burn::backend::ops::FloatTensorOps;
use ::burn::backend::tensor::FloatTensor;
use ::burn::backend::{Autodiff, Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use ::burn::tensor::{Tensor, TensorData};

use crate::kernels::{Lstm, LstmGradients, LstmTape, LstmWeights, Order};

#[backend_extension(Flex, Autodiff)]
pub trait FusedLstm: Backend {
    /// x: (steps, batch, inputs); input: (directions x 4 H, inputs), recurrent: (directions x 4 H,
    /// H), bias: (directions x 4 H).
    fn fused_lstm(
        x: FloatTensor<Self>,
        input: FloatTensor<Self>,
        recurrent: FloatTensor<Self>,
        bias: FloatTensor<Self>,
    ) -> FloatTensor<Self>;
}

/// (steps, batch, inputs) -> (steps, batch, directions x H); weights of the directions one behind
/// the other.
pub(super) fn lstm(
    x: Tensor<3>,
    input: Tensor<2>,
    recurrent: Tensor<2>,
    bias: Tensor<1>,
) -> Tensor<3> {
    let found = <Dispatch as FusedLstm>::fused_lstm(
        x.into_dispatch(),
        input.into_dispatch(),
        recurrent.into_dispatch(),
        bias.into_dispatch(),
    );
    Tensor::from_dispatch(found)
}

type Values = FloatTensor<Flex>;

fn numbers(tensor: &Values) -> Vec<f32> {
    tensor.to_contiguous().storage::<f32>().to_vec()
}

fn tensor(values: Vec<f32>, shape: &[usize]) -> Values {
    Flex::float_from_data(TensorData::new(values, shape.to_vec()), &Default::default())
}

/// The layer in our terms.
#[derive(Debug)]
struct Layer {
    steps: usize,
    batch: usize,
    inputs: usize,
    hidden: usize,
    directions: usize,
    x: Vec<f32>,
    input: Vec<f32>,
    recurrent: Vec<f32>,
    bias: Vec<f32>,
    zero_bias: Vec<f32>,
}

impl Layer {
    fn new(x: &Values, input: &Values, recurrent: &Values, bias: &Values) -> Self {
        let (of_x, of_recurrent) = (x.shape(), recurrent.shape());
        let (steps, batch, inputs, hidden) = (of_x[0], of_x[1], of_x[2], of_recurrent[1]);
        let directions = of_recurrent[0] / (4 * hidden);
        let [x, input, recurrent, bias] = [x, input, recurrent, bias].map(numbers);
        Self {
            steps,
            batch,
            inputs,
            hidden,
            directions,
            x,
            input,
            recurrent,
            bias,
            zero_bias: vec![0.0; 4 * hidden],
        }
    }

    fn weights(&self, direction: usize) -> LstmWeights<'_> {
        let part = |values: &'_ [f32]| -> std::ops::Range<usize> {
            let length = values.len() / self.directions;
            direction * length..(direction + 1) * length
        };
        LstmWeights {
            input: &self.input[part(&self.input)],
            recurrent: &self.recurrent[part(&self.recurrent)],
            input_bias: &self.bias[part(&self.bias)],
            recurrent_bias: &self.zero_bias,
        }
    }

    fn lstm(&self, direction: usize) -> Lstm {
        Lstm::new(
            self.weights(direction),
            if direction == 0 {
                Order::Forward
            } else {
                Order::Reverse
            },
        )
    }

    /// The work of every direction, at once where there are two.
    fn each<T: Send>(&self, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
        if self.directions == 1 {
            return vec![work(0)];
        }
        let (first, second) = rayon::join(|| work(0), || work(1));
        vec![first, second]
    }

    fn forward(&self) -> Vec<LstmTape> {
        self.each(|direction| self.lstm(direction).forward(&self.x, self.batch))
    }

    fn output(&self, tapes: &[LstmTape]) -> Values {
        let outputs: Vec<&[f32]> = tapes.iter().map(LstmTape::output).collect();
        let joined = crate::stacks::join(&outputs, self.hidden);
        tensor(
            joined,
            &[self.steps, self.batch, self.directions * self.hidden],
        )
    }

    /// Gradients of x, input, recurrent, bias.
    fn backward(&self, tapes: &[LstmTape], output_gradient: &[f32]) -> [Values; 4] {
        let found = self.each(|direction| {
            let gradient =
                crate::stacks::part(output_gradient, self.hidden, self.directions, direction);
            let mut of_input = vec![0.0; self.input.len() / self.directions];
            let mut of_recurrent = vec![0.0; self.recurrent.len() / self.directions];
            let mut of_bias = vec![0.0; 4 * self.hidden];
            let gradients = LstmGradients {
                input: &mut of_input,
                recurrent: &mut of_recurrent,
                bias: &mut of_bias,
            };
            let of_x = self.lstm(direction).backward(
                self.weights(direction),
                &self.x,
                &tapes[direction],
                &gradient,
                gradients,
            );
            [of_x, of_input, of_recurrent, of_bias]
        });
        let gates = 4 * self.hidden;
        let joined = |index: usize| -> Vec<f32> {
            found
                .iter()
                .flat_map(|parts| &parts[index])
                .copied()
                .collect()
        };
        let mut of_x = vec![0.0; self.x.len()];
        for parts in &found {
            of_x.iter_mut()
                .zip(&parts[0])
                .for_each(|(sum, part)| *sum += part);
        }
        [
            tensor(of_x, &[self.steps, self.batch, self.inputs]),
            tensor(joined(1), &[self.directions * gates, self.inputs]),
            tensor(joined(2), &[self.directions * gates, self.hidden]),
            tensor(joined(3), &[self.directions * gates]),
        ]
    }
}

impl FusedLstm for Flex {
    fn fused_lstm(x: Values, input: Values, recurrent: Values, bias: Values) -> Values {
        let layer = Layer::new(&x, &input, &recurrent, &bias);
        layer.output(&layer.forward())
    }
}

#[derive(Debug)]
struct LstmBackward;

impl Backward<Flex, 4> for LstmBackward {
    type State = Arc<(Layer, Vec<LstmTape>)>;

    fn backward(self, ops: Ops<Self::State, 4>, grads: &mut Gradients, _: &mut Checkpointer) {
        let gradient = numbers(&grads.consume::<Flex>(&ops.node));
        let (layer, tapes) = ops.state.as_ref();
        for (parent, gradient) in ops
            .parents
            .into_iter()
            .zip(layer.backward(tapes, &gradient))
        {
            if let Some(parent) = parent {
                grads.register::<Flex>(parent.id, gradient);
            }
        }
    }
}

impl<C: CheckpointStrategy> FusedLstm for Autodiff<Flex, C> {
    fn fused_lstm(
        x: FloatTensor<Self>,
        input: FloatTensor<Self>,
        recurrent: FloatTensor<Self>,
        bias: FloatTensor<Self>,
    ) -> FloatTensor<Self> {
        let [
            (x, of_x),
            (input, of_input),
            (recurrent, of_recurrent),
            (bias, of_bias),
        ] = [x, input, recurrent, bias].map(FloatTensor::<Self>::into_parts);
        let layer = Layer::new(&x, &input, &recurrent, &bias);
        let tapes = layer.forward();
        let output = layer.output(&tapes);
        match LstmBackward
            .prepare::<C>([of_x, of_input, of_recurrent, of_bias])
            .compute_bound()
            .stateful()
        {
            OpsKind::Tracked(operation) => operation.finish(Arc::new((layer, tapes)), output),
            OpsKind::UnTracked(operation) => operation.finish(output),
        }
    }
}
