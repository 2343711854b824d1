//! A network's layers in sequence, forward and backward, for a part of a batch.

use crate::kernels::{
    Convolution, ConvolutionGradients, Linear, LinearGradients, Lstm, LstmGradients, LstmTape, LstmWeights, Order, Padding, relu,
    relu_backward,
};
use crate::shape::{Direction, LstmPlace, NetworkShape, Places};

/// The layers with their weights packed.
#[derive(Debug, Clone)]
pub(crate) struct Layers {
    places: Places,
    convolutions: Vec<Convolution>,
    /// Layers, each with one direction or two.
    lstm: Vec<Vec<Lstm>>,
    linear: Linear,
}

/// What the way forward leaves for the way back.
#[derive(Debug, Default)]
pub(crate) struct Tape {
    /// What went into each convolution, and last what came out of them.
    convolved: Vec<Vec<f32>>,
    /// What went into each LSTM layer but the first, and last what came out of them.
    recurrent: Vec<Vec<f32>>,
    lstm: Vec<Vec<LstmTape>>,
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
        parts.iter().for_each(|part| joined.extend_from_slice(&part[row * width..][..width]));
    }
    joined
}

/// What [`join`] joined.
pub(crate) fn part(joined: &[f32], width: usize, parts: usize, index: usize) -> Vec<f32> {
    joined.chunks_exact(width * parts).flat_map(|row| &row[index * width..][..width]).copied().collect()
}

impl Layers {
    pub fn new(shape: &NetworkShape, parameters: &[f32]) -> Self {
        let places = shape.places();
        let padding = if shape.direction == Direction::Both { Padding::Same } else { Padding::Causal };
        let convolution = |(weight, bias): &(std::ops::Range<usize>, std::ops::Range<usize>)| {
            Convolution::new(&parameters[weight.clone()], &parameters[bias.clone()], shape.kernel, padding)
        };
        let directions = |layer: &Vec<LstmPlace>| {
            layer
                .iter()
                .zip([Order::Forward, Order::Reverse])
                .map(|(place, order)| Lstm::new(lstm_weights(parameters, place), order))
                .collect()
        };
        Self {
            convolutions: places.convolutions.iter().map(convolution).collect(),
            lstm: places.lstm.iter().map(directions).collect(),
            linear: Linear::new(&parameters[places.linear.0.clone()], &parameters[places.linear.1.clone()]),
            places,
        }
    }

    /// The convolutions, the LSTM layers in forward order, the linear layer.
    pub fn parts(&self) -> (&[Convolution], impl Iterator<Item = &Lstm>, &Linear) {
        (&self.convolutions, self.lstm.iter().flatten(), &self.linear)
    }

    /// input: (steps, batch, inputs) -> (steps, batch, outputs).
    pub fn forward(&self, input: Vec<f32>, batch: usize) -> Vec<f32> {
        self.run(input, batch, None)
    }

    /// As [`Layers::forward`], with what the way back needs.
    pub fn forward_with_tape(&self, input: Vec<f32>, batch: usize) -> (Vec<f32>, Tape) {
        let mut tape = Tape::default();
        (self.run(input, batch, Some(&mut tape)), tape)
    }

    fn run(&self, input: Vec<f32>, batch: usize, mut tape: Option<&mut Tape>) -> Vec<f32> {
        let mut current = input;
        for convolution in &self.convolutions {
            let mut next = convolution.forward(&current, batch);
            relu(&mut next);
            if let Some(tape) = &mut tape {
                tape.convolved.push(current);
            }
            current = next;
        }
        for (index, layer) in self.lstm.iter().enumerate() {
            let tapes = run_directions(layer, &current, batch);
            let outputs: Vec<&[f32]> = tapes.iter().map(LstmTape::output).collect();
            let next = join(&outputs, layer[0].hidden());
            if let Some(tape) = &mut tape {
                if index == 0 {
                    tape.convolved.push(current)
                } else {
                    tape.recurrent.push(current)
                }
                tape.lstm.push(tapes);
            }
            current = next;
        }
        let output = self.linear.forward(&current);
        if let Some(tape) = tape {
            tape.recurrent.push(current);
        }
        output
    }

    /// Adds the gradients of all parameters to `gradients`; output_gradient: (steps, batch, outputs). Returns the input's.
    pub fn backward(&self, parameters: &[f32], tape: &Tape, output_gradient: &[f32], batch: usize, gradients: &mut [f32]) -> Vec<f32> {
        let (weight, bias) = (&self.places.linear.0, &self.places.linear.1);
        let last = tape.recurrent.last().map_or(&[] as &[f32], Vec::as_slice);
        let [of_weight, of_bias] = disjoint(gradients, [weight, bias]);
        let of_linear = LinearGradients { weight: of_weight, bias: of_bias };
        let mut current = self.linear.backward(&parameters[weight.clone()], last, output_gradient, of_linear);
        for (index, layer) in self.lstm.iter().enumerate().rev() {
            let input = if index == 0 { &tape.convolved[self.convolutions.len()] } else { &tape.recurrent[index - 1] };
            current = self.lstm_backward(parameters, (index, layer), &tape.lstm[index], input, &current, gradients);
        }
        for (index, convolution) in self.convolutions.iter().enumerate().rev() {
            relu_backward(&tape.convolved[index + 1], &mut current);
            let (weight, bias) = &self.places.convolutions[index];
            let [of_weight, of_bias] = disjoint(gradients, [weight, bias]);
            let of_convolution = ConvolutionGradients { weight: of_weight, bias: of_bias };
            current = convolution.backward(&parameters[weight.clone()], &tape.convolved[index], &current, batch, of_convolution);
        }
        current
    }

    fn lstm_backward(
        &self,
        parameters: &[f32],
        (index, layer): (usize, &[Lstm]),
        tapes: &[LstmTape],
        input: &[f32],
        output_gradient: &[f32],
        gradients: &mut [f32],
    ) -> Vec<f32> {
        let places = &self.places.lstm[index];
        // One direction's tensors lie behind the other's: cut there, and each direction has its own.
        let start = places[0].input.start;
        let cut = places[0].recurrent_bias.end - start;
        let (first, second) = gradients[start..].split_at_mut(cut);
        let back = |direction: usize, gradients: &mut [f32]| {
            let (lstm, place) = (&layer[direction], &places[direction]);
            let gradient = part(output_gradient, lstm.hidden(), layer.len(), direction);
            lstm_direction_backward(lstm, lstm_weights(parameters, place), &tapes[direction], input, &gradient, place, gradients)
        };
        if layer.len() == 1 {
            return back(0, first);
        }
        let (mut of_input, other) = rayon::join(|| back(0, first), || back(1, second));
        of_input.iter_mut().zip(other).for_each(|(sum, other)| *sum += other);
        of_input
    }
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
    let of_weights = LstmGradients { input: of_input_weights, recurrent, bias: input_bias };
    let of_input = lstm.backward(weights, input, tape, output_gradient, of_weights);
    rest[..input_bias.len()].copy_from_slice(input_bias);
    of_input
}

fn run_directions(layer: &[Lstm], input: &[f32], batch: usize) -> Vec<LstmTape> {
    match layer {
        [first, second] => {
            let (first, second) = rayon::join(|| first.forward(input, batch), || second.forward(input, batch));
            vec![first, second]
        }
        layer => layer.iter().map(|lstm| lstm.forward(input, batch)).collect(),
    }
}

/// Weight and bias, which lie one behind the other.
fn disjoint<'a>(values: &'a mut [f32], [weight, bias]: [&std::ops::Range<usize>; 2]) -> [&'a mut [f32]; 2] {
    let (of_weight, of_bias) = values[weight.start..bias.end].split_at_mut(weight.len());
    [of_weight, of_bias]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Network;
    use crate::kernels::testing::{check_gradient, values, weighted_sum};

    #[test]
    fn gradients_of_a_whole_network_agree_with_differences() {
        for (direction, convolutions, layers) in [(Direction::Both, 2, 2), (Direction::Forward, 1, 2), (Direction::Both, 0, 1)] {
            let shape = NetworkShape { inputs: 3, channels: 4, kernel: 3, convolutions, hidden: 5, layers, direction, outputs: 2 };
            let (steps, batch) = (4, 2);
            let network = Network::new(shape.clone(), 7).unwrap();
            let (input, along) = (values(steps * batch * 3, 1), values(steps * batch * 2, 2));
            let loss =
                |parameters: &[f32], input: &[f32]| weighted_sum(&Layers::new(&shape, parameters).forward(input.to_vec(), batch), &along);
            let layers = Layers::new(&shape, network.parameters());
            let (_, tape) = layers.forward_with_tape(input.clone(), batch);
            let mut gradients = vec![0.0; network.parameters().len()];
            let of_input = layers.backward(network.parameters(), &tape, &along, batch, &mut gradients);
            check_gradient("parameters", network.parameters(), &gradients, |parameters| loss(parameters, &input));
            check_gradient("input", &input, &of_input, |input| loss(network.parameters(), input));
        }
    }
}
