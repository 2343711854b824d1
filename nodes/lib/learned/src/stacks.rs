//! Layers of one kind in sequence, forward and backward: what networks are put together from.

use std::ops::Range;

use crate::kernels::{
    Convolution, ConvolutionGradients, Linear, LinearGradients, Lstm, LstmGradients, LstmTape,
    LstmWeights, Order, Padding, relu, relu_backward,
};
use crate::shape::{LstmPlace, Places};

/// Convolutions with ReLU.
#[derive(Debug, Clone)]
pub(crate) struct Convolutions(Vec<Convolution>);

impl Convolutions {
    pub fn new(places: &Places, parameters: &[f32], kernel: usize, padding: Padding) -> Self {
        let convolution = |(weight, bias): &(Range<usize>, Range<usize>)| {
            Convolution::new(
                &parameters[weight.clone()],
                &parameters[bias.clone()],
                kernel,
                padding,
            )
        };
        Self(places.convolutions.iter().map(convolution).collect())
    }

    pub fn layers(&self) -> &[Convolution] {
        &self.0
    }

    /// input: (steps, batch, inputs) -> (steps out, batch, channels); what went into each goes to
    /// `tape`.
    pub fn forward(
        &self,
        input: Vec<f32>,
        batch: usize,
        mut tape: Option<&mut Vec<Vec<f32>>>,
    ) -> Vec<f32> {
        let mut current = input;
        for convolution in &self.0 {
            let mut next = convolution.forward(&current, batch);
            relu(&mut next);
            if let Some(tape) = &mut tape {
                tape.push(current);
            }
            current = next;
        }
        current
    }

    /// Adds the gradients of the weights, returns the input's; inputs: what went into each; output:
    /// what came out of the last.
    pub fn backward(
        &self,
        places: &Places,
        parameters: &[f32],
        (inputs, output): (&[Vec<f32>], &[f32]),
        output_gradient: Vec<f32>,
        batch: usize,
        gradients: &mut [f32],
    ) -> Vec<f32> {
        let mut current = output_gradient;
        for (index, convolution) in self.0.iter().enumerate().rev() {
            relu_backward(
                inputs.get(index + 1).map_or(output, Vec::as_slice),
                &mut current,
            );
            let (weight, bias) = &places.convolutions[index];
            let [of_weight, of_bias] = disjoint(gradients, [weight, bias]);
            let of_convolution = ConvolutionGradients {
                weight: of_weight,
                bias: of_bias,
            };
            current = convolution.backward(
                &parameters[weight.clone()],
                &inputs[index],
                &current,
                batch,
                of_convolution,
            );
        }
        current
    }
}

/// LSTM layers, each with one direction or two.
#[derive(Debug, Clone)]
pub(crate) struct Recurrent(Vec<Vec<Lstm>>);

/// What the way forward leaves for the way back.
#[derive(Debug, Default)]
pub(crate) struct RecurrentTape {
    /// What went into each layer.
    inputs: Vec<Vec<f32>>,
    layers: Vec<Vec<LstmTape>>,
}

impl RecurrentTape {
    /// What went into the first layer.
    pub fn input(&self) -> &[f32] {
        self.inputs.first().map_or(&[], Vec::as_slice)
    }
}

impl Recurrent {
    pub fn new(places: &Places, parameters: &[f32]) -> Self {
        let directions = |layer: &Vec<LstmPlace>| {
            let both = layer.iter().zip([Order::Forward, Order::Reverse]);
            both.map(|(place, order)| Lstm::new(lstm_weights(parameters, place), order))
                .collect()
        };
        Self(places.lstm.iter().map(directions).collect())
    }

    /// The layers, each direction by itself.
    pub fn layers(&self) -> impl Iterator<Item = &Lstm> {
        self.0.iter().flatten()
    }

    /// input: (steps, batch, inputs) -> (steps, batch, hidden x directions).
    pub fn forward(
        &self,
        input: Vec<f32>,
        batch: usize,
        mut tape: Option<&mut RecurrentTape>,
    ) -> Vec<f32> {
        let mut current = input;
        for layer in &self.0 {
            let tapes = run_directions(layer, &current, batch);
            let outputs: Vec<&[f32]> = tapes.iter().map(LstmTape::output).collect();
            let next = join(&outputs, layer[0].hidden());
            if let Some(tape) = &mut tape {
                tape.inputs.push(current);
                tape.layers.push(tapes);
            }
            current = next;
        }
        current
    }

    /// Adds the gradients of the weights, returns the input's.
    pub fn backward(
        &self,
        places: &Places,
        parameters: &[f32],
        tape: &RecurrentTape,
        output_gradient: Vec<f32>,
        gradients: &mut [f32],
    ) -> Vec<f32> {
        let mut current = output_gradient;
        for (index, layer) in self.0.iter().enumerate().rev() {
            let known = (tape.layers[index].as_slice(), tape.inputs[index].as_slice());
            current = layer_backward(
                layer,
                &places.lstm[index],
                parameters,
                known,
                &current,
                gradients,
            );
        }
        current
    }
}

fn layer_backward(
    layer: &[Lstm],
    places: &[LstmPlace],
    parameters: &[f32],
    (tapes, input): (&[LstmTape], &[f32]),
    output_gradient: &[f32],
    gradients: &mut [f32],
) -> Vec<f32> {
    // One direction's tensors lie behind the other's: cut there, and each direction has its own.
    let start = places[0].input.start;
    let cut = places[0].recurrent_bias.end - start;
    let (first, second) = gradients[start..].split_at_mut(cut);
    let back = |direction: usize, gradients: &mut [f32]| {
        let (lstm, place) = (&layer[direction], &places[direction]);
        let gradient = part(output_gradient, lstm.hidden(), layer.len(), direction);
        lstm_direction_backward(
            lstm,
            lstm_weights(parameters, place),
            &tapes[direction],
            input,
            &gradient,
            place,
            gradients,
        )
    };
    if layer.len() == 1 {
        return back(0, first);
    }
    let (mut of_input, other) = rayon::join(|| back(0, first), || back(1, second));
    of_input
        .iter_mut()
        .zip(other)
        .for_each(|(sum, other)| *sum += other);
    of_input
}

/// gradients: from this direction's first tensor on.
fn lstm_direction_backward(
    lstm: &Lstm,
    weights: LstmWeights<'_>,
    tape: &LstmTape,
    input: &[f32],
    output_gradient: &[f32],
    place: &LstmPlace,
    gradients: &mut [f32],
) -> Vec<f32> {
    let (of_input_weights, rest) = gradients.split_at_mut(place.input.len());
    let (recurrent, rest) = rest.split_at_mut(place.recurrent.len());
    let (input_bias, rest) = rest.split_at_mut(place.input_bias.len());
    let of_weights = LstmGradients {
        input: of_input_weights,
        recurrent,
        bias: input_bias,
    };
    let of_input = lstm.backward(weights, input, tape, output_gradient, of_weights);
    rest[..input_bias.len()].copy_from_slice(input_bias);
    of_input
}

fn run_directions(layer: &[Lstm], input: &[f32], batch: usize) -> Vec<LstmTape> {
    match layer {
        [first, second] => {
            let (first, second) = rayon::join(
                || first.forward(input, batch),
                || second.forward(input, batch),
            );
            vec![first, second]
        }
        layer => layer
            .iter()
            .map(|lstm| lstm.forward(input, batch))
            .collect(),
    }
}

/// The linear layer behind them.
pub(crate) fn linear_of(places: &Places, parameters: &[f32]) -> Linear {
    Linear::new(
        &parameters[places.linear.0.clone()],
        &parameters[places.linear.1.clone()],
    )
}

/// Adds its weights' gradients, returns its input's.
pub(crate) fn linear_backward(
    linear: &Linear,
    places: &Places,
    parameters: &[f32],
    (input, output_gradient): (&[f32], &[f32]),
    gradients: &mut [f32],
) -> Vec<f32> {
    let (weight, bias) = (&places.linear.0, &places.linear.1);
    let [of_weight, of_bias] = disjoint(gradients, [weight, bias]);
    linear.backward(
        &parameters[weight.clone()],
        input,
        output_gradient,
        LinearGradients {
            weight: of_weight,
            bias: of_bias,
        },
    )
}

fn lstm_weights<'a>(parameters: &'a [f32], place: &LstmPlace) -> LstmWeights<'a> {
    LstmWeights {
        input: &parameters[place.input.clone()],
        recurrent: &parameters[place.recurrent.clone()],
        input_bias: &parameters[place.input_bias.clone()],
        recurrent_bias: &parameters[place.recurrent_bias.clone()],
    }
}

/// Rows of both parts beside each other.
pub(crate) fn join(parts: &[&[f32]], width: usize) -> Vec<f32> {
    if let [only] = parts {
        return only.to_vec();
    }
    let mut joined = Vec::with_capacity(parts.iter().map(|part| part.len()).sum());
    for row in 0..parts[0].len() / width {
        parts
            .iter()
            .for_each(|part| joined.extend_from_slice(&part[row * width..][..width]));
    }
    joined
}

/// What [`join`] joined.
pub(crate) fn part(joined: &[f32], width: usize, parts: usize, index: usize) -> Vec<f32> {
    joined
        .chunks_exact(width * parts)
        .flat_map(|row| &row[index * width..][..width])
        .copied()
        .collect()
}

/// Weight and bias, which lie one behind the other.
fn disjoint<'a>(values: &'a mut [f32], [weight, bias]: [&Range<usize>; 2]) -> [&'a mut [f32]; 2] {
    let (of_weight, of_bias) = values[weight.start..bias.end].split_at_mut(weight.len());
    [of_weight, of_bias]
}
