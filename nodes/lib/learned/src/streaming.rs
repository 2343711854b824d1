//! Step by step, for live use: a causal network that remembers.
//!
//! Each convolution keeps its last inputs, each LSTM layer its state; a step costs one product a
//! layer and allocates nothing. It computes what [`Network::forward`] computes over the sequence so
//! far.

use crate::kernels::{LstmState, PackedMatrix, View, add_product, fill_rows, relu};
use crate::layers::Layers;
use crate::shape::Direction;
use crate::{LearnedError, Network, NetworkShape};

/// A causal network over several sequences that advance together, such as the placements on one
/// body.
#[derive(Debug, Clone)]
pub struct StreamingBatch {
    shape: NetworkShape,
    layers: Layers,
    sequences: usize,
    convolutions: Vec<ConvolutionState>,
    lstm: Vec<LstmState>,
    output: Vec<f32>,
}

/// The last inputs of a convolution, as many as it has taps, in a ring: (taps, sequences, inputs).
#[derive(Debug, Clone)]
struct ConvolutionState {
    ring: Vec<f32>,
    taps: usize,
    /// Where the newest lies.
    newest: usize,
    output: Vec<f32>,
}

impl ConvolutionState {
    fn step(&mut self, input: &[f32], sequences: usize, taps: &[PackedMatrix], bias: &[f32]) {
        self.newest = (self.newest + 1) % taps.len();
        let wide = input.len();
        self.ring[self.newest * wide..][..wide].copy_from_slice(input);
        fill_rows(&mut self.output, bias);
        for (age, matrix) in taps.iter().rev().enumerate() {
            let place = (self.newest + taps.len() - age) % taps.len();
            add_product(
                &mut self.output,
                View::new(
                    &self.ring[place * wide..][..wide],
                    sequences,
                    wide / sequences,
                ),
                matrix,
            );
        }
        relu(&mut self.output);
    }

    /// Where one sequence's input of some steps ago lies.
    fn place(&self, age: usize, sequence: usize, sequences: usize) -> std::ops::Range<usize> {
        let taps = self.taps;
        let wide = self.ring.len() / taps;
        let start = (self.newest + taps - age) % taps * wide + sequence * (wide / sequences);
        start..start + wide / sequences
    }

    /// Undoes the last step for one sequence. Its oldest input, which that step overwrote, is not
    /// read again.
    fn undo(&mut self, sequence: usize, sequences: usize) {
        for age in 1..self.taps {
            let (newer, older) = (
                self.place(age - 1, sequence, sequences),
                self.place(age, sequence, sequences),
            );
            self.ring.copy_within(older, newer.start);
        }
    }

    fn reset_sequence(&mut self, sequence: usize, sequences: usize) {
        for age in 0..self.taps {
            let place = self.place(age, sequence, sequences);
            self.ring[place].fill(0.0);
        }
    }
}

impl StreamingBatch {
    /// For so many sequences (at least one), their states at zero.
    ///
    /// # Errors
    /// Where the network reads its input in both directions.
    pub fn new(network: &Network, sequences: usize) -> Result<Self, LearnedError> {
        let shape = network.shape().clone();
        if shape.direction == Direction::Both {
            return Err(LearnedError::NotCausal);
        }
        let sequences = sequences.max(1);
        let convolution = |index: usize| {
            let inputs = if index == 0 {
                shape.inputs
            } else {
                shape.channels
            };
            let ring = vec![0.0; shape.kernel * sequences * inputs];
            ConvolutionState {
                ring,
                taps: shape.kernel,
                newest: 0,
                output: vec![0.0; sequences * shape.channels],
            }
        };
        Ok(Self {
            layers: Layers::new(&shape, network.parameters()),
            sequences,
            convolutions: (0..shape.convolutions).map(convolution).collect(),
            lstm: vec![LstmState::new(sequences, shape.hidden); shape.layers],
            output: vec![0.0; sequences * shape.outputs],
            shape,
        })
    }

    /// Sequences.
    #[must_use]
    pub fn sequences(&self) -> usize {
        self.sequences
    }

    /// All states back to zero, as at a gap in the input.
    pub fn reset(&mut self) {
        self.convolutions
            .iter_mut()
            .for_each(|state| state.ring.fill(0.0));
        self.lstm.iter_mut().for_each(LstmState::reset);
    }

    /// One sequence's states back to zero.
    ///
    /// # Panics
    /// For a sequence that is not there.
    pub fn reset_sequence(&mut self, sequence: usize) {
        assert!(
            sequence < self.sequences,
            "sequence {sequence} of {}",
            self.sequences
        );
        self.convolutions
            .iter_mut()
            .for_each(|state| state.reset_sequence(sequence, self.sequences));
        self.lstm
            .iter_mut()
            .for_each(|state| state.reset_sequence(sequence, self.sequences));
    }

    /// One step of the sequences that `advance` marks; the states of the others, and of those
    /// without a mark, stay as they are, and their rows of the output mean nothing. It costs as
    /// much as a step of all, and more than that where some stay.
    ///
    /// # Errors
    /// Where the input's length does not fit; the states stay as they were.
    pub fn step_some(&mut self, input: &[f32], advance: &[bool]) -> Result<&[f32], LearnedError> {
        let stays = |sequence: &usize| !advance.get(*sequence).is_some_and(|advances| *advances);
        if !(0..self.sequences).any(|sequence| stays(&sequence)) {
            return self.step(input);
        }
        let before = self.lstm.clone();
        self.step(input)?;
        for sequence in (0..self.sequences).filter(stays) {
            self.convolutions
                .iter_mut()
                .for_each(|state| state.undo(sequence, self.sequences));
            for (state, before) in self.lstm.iter_mut().zip(&before) {
                state.restore_sequence(before, sequence, self.sequences);
            }
        }
        Ok(&self.output)
    }

    /// One step of every sequence; input: (sequences, inputs), output: (sequences, outputs).
    ///
    /// # Errors
    /// Where the input's length does not fit; the states stay as they were.
    pub fn step(&mut self, input: &[f32]) -> Result<&[f32], LearnedError> {
        crate::network::check_input(input, self.sequences, 1, self.shape.inputs)?;
        let (convolutions, layers, linear) = self.layers.parts();
        let mut current = input;
        for (convolution, state) in convolutions.iter().zip(&mut self.convolutions) {
            let (taps, bias) = convolution.parts();
            state.step(current, self.sequences, taps, bias);
            current = &state.output;
        }
        for (layer, state) in layers.zip(&mut self.lstm) {
            layer.step(current, state);
            current = state.hidden();
        }
        linear.forward_into(current, &mut self.output);
        Ok(&self.output)
    }
}

/// A causal network over one sequence.
#[derive(Debug, Clone)]
pub struct StreamingNetwork(StreamingBatch);

impl StreamingNetwork {
    /// Its state at zero.
    ///
    /// # Errors
    /// Where the network reads its input in both directions.
    pub fn new(network: &Network) -> Result<Self, LearnedError> {
        Ok(Self(StreamingBatch::new(network, 1)?))
    }

    /// The state back to zero, as at a gap in the input.
    pub fn reset(&mut self) {
        self.0.reset();
    }

    /// One step; input: (inputs), output: (outputs).
    ///
    /// # Errors
    /// Where the input's length does not fit; the state stays as it was.
    pub fn step(&mut self, input: &[f32]) -> Result<&[f32], LearnedError> {
        self.0.step(input)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{swap_leading_axes, testing::values};

    const SEQUENCES: usize = 7;
    const STEPS: usize = 40;

    fn network(convolutions: usize, kernel: usize) -> Network {
        let shape = NetworkShape {
            inputs: 9,
            channels: 12,
            kernel,
            convolutions,
            hidden: 20,
            layers: 2,
            direction: Direction::Forward,
            outputs: 3,
        };
        Network::new(shape, 5).unwrap()
    }

    #[test]
    fn equals_the_forward_pass() {
        for (convolutions, kernel) in [(3, 5), (2, 4), (1, 1), (0, 3)] {
            let network = network(convolutions, kernel);
            let input = values(SEQUENCES * STEPS * 9, 1);
            let expected = swap_leading_axes(
                &network.forward(&input, SEQUENCES, STEPS).unwrap(),
                SEQUENCES,
                STEPS,
                3,
            );
            let by_steps = swap_leading_axes(&input, SEQUENCES, STEPS, 9);
            let mut batch = StreamingBatch::new(&network, SEQUENCES).unwrap();
            let mut single = StreamingNetwork::new(&network).unwrap();
            for _ in 0..2 {
                for (input, expected) in by_steps
                    .chunks(SEQUENCES * 9)
                    .zip(expected.chunks(SEQUENCES * 3))
                {
                    let found = batch.step(input).unwrap();
                    assert!(
                        found
                            .iter()
                            .zip(expected)
                            .all(|(found, expected)| (found - expected).abs() < 1e-5),
                        "{found:?} {expected:?}"
                    );
                    assert_eq!(single.step(&input[..9]).unwrap(), &found[..3]);
                }
                batch.reset();
                single.reset();
            }
        }
    }

    #[test]
    fn sequences_pause_and_begin_anew_each_on_its_own() {
        for (convolutions, kernel) in [(3, 5), (1, 1), (0, 3)] {
            let network = network(convolutions, kernel);
            let mut batch = StreamingBatch::new(&network, SEQUENCES).unwrap();
            let mut singles = vec![StreamingNetwork::new(&network).unwrap(); SEQUENCES];
            let input = values(SEQUENCES * STEPS * 9, 2);
            for (step, input) in input.chunks(SEQUENCES * 9).enumerate() {
                let advance: Vec<bool> = (0..SEQUENCES)
                    .map(|sequence| (step * 5 + sequence * 3) % 7 > 2 || step % 4 == 0)
                    .collect();
                if step % 9 == 5 {
                    batch.reset_sequence(step % SEQUENCES);
                    singles[step % SEQUENCES].reset();
                }
                let found = batch.step_some(input, &advance).unwrap();
                for (sequence, single) in singles
                    .iter_mut()
                    .enumerate()
                    .filter(|(sequence, _)| advance[*sequence])
                {
                    assert_eq!(
                        single.step(&input[9 * sequence..][..9]).unwrap(),
                        &found[3 * sequence..][..3],
                        "step {step}"
                    );
                }
            }
        }
    }

    #[test]
    fn refuses_both_directions_and_wrong_lengths() {
        let both = NetworkShape {
            direction: Direction::Both,
            ..network(1, 3).shape().clone()
        };
        let error = StreamingNetwork::new(&Network::new(both, 1).unwrap()).unwrap_err();
        assert!(error.to_string().contains("both directions"));
        let mut streaming = StreamingNetwork::new(&network(1, 3)).unwrap();
        assert_eq!(
            streaming.step(&[0.0; 8]).unwrap_err().to_string(),
            "network input: 8 numbers, 1 sequences x 1 steps x 9 inputs are 9"
        );
    }
}
