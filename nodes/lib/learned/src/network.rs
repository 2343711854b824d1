//! A network: its shape and its weights.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::LearnedError;
use crate::kernels::swap_leading_axes;
use crate::layers::Layers;
use crate::shape::{NetworkShape, Tensor};

/// Sequences that one thread takes at a time; a fixed number, so that the bits do not depend on how
/// many threads there are.
pub(crate) const SHARD: usize = 16;

/// Convolutions with ReLU, LSTM layers, a linear layer; the weights lie in one vector, in the order
/// of [`NetworkShape::tensors`].
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    shape: NetworkShape,
    parameters: Vec<f32>,
}

impl Network {
    /// Initial weights from a seed, distributed as PyTorch's defaults: uniform in +-1 / sqrt(inputs
    /// x kernel) for convolutions, +-1 / sqrt(hidden) for the LSTM, +-1 / sqrt(inputs) for the
    /// linear layer; biases alike.
    ///
    /// # Errors
    /// Where the shape is not sound.
    pub fn new(shape: NetworkShape, seed: u64) -> Result<Self, LearnedError> {
        shape.check()?;
        let parameters = initial_weights(&shape.tensors(), seed);
        Ok(Self { shape, parameters })
    }

    /// parameters: as many as the shape has.
    pub(crate) fn from_parameters(shape: NetworkShape, parameters: Vec<f32>) -> Self {
        Self { shape, parameters }
    }

    /// Its shape.
    #[must_use]
    pub fn shape(&self) -> &NetworkShape {
        &self.shape
    }

    /// All weights.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// All weights, to change.
    pub fn parameters_mut(&mut self) -> &mut [f32] {
        &mut self.parameters
    }

    /// A tensor by its name.
    #[must_use]
    pub fn tensor(&self, name: &str) -> Option<&[f32]> {
        let tensor = self
            .shape
            .tensors()
            .into_iter()
            .find(|tensor| tensor.name == name)?;
        Some(&self.parameters[tensor.range])
    }

    /// input: (batch, steps, inputs) -> (batch, steps, outputs); state begins at zero. Packs the
    /// weights first: for many calls, see [`Network::prepare`].
    ///
    /// # Errors
    /// Where the input's length does not fit.
    pub fn forward(
        &self,
        input: &[f32],
        batch: usize,
        steps: usize,
    ) -> Result<Vec<f32>, LearnedError> {
        self.prepare().forward(input, batch, steps)
    }

    /// The network with its weights packed.
    #[must_use]
    pub fn prepare(&self) -> PreparedNetwork {
        PreparedNetwork {
            shape: self.shape.clone(),
            layers: Layers::new(&self.shape, &self.parameters),
        }
    }
}

/// A network with its weights packed, for many calls.
#[derive(Debug, Clone)]
pub struct PreparedNetwork {
    shape: NetworkShape,
    pub(crate) layers: Layers,
}

impl PreparedNetwork {
    /// Its shape.
    #[must_use]
    pub fn shape(&self) -> &NetworkShape {
        &self.shape
    }

    /// input: (batch, steps, inputs) -> (batch, steps, outputs); state begins at zero. On rayon's
    /// threads; the same bits on any number.
    ///
    /// # Errors
    /// Where the input's length does not fit.
    pub fn forward(
        &self,
        input: &[f32],
        batch: usize,
        steps: usize,
    ) -> Result<Vec<f32>, LearnedError> {
        let (inputs, outputs) = (self.shape.inputs, self.shape.outputs);
        check_input(input, batch, steps, inputs)?;
        let mut output = vec![0.0; batch * steps * outputs];
        if output.is_empty() {
            return Ok(output);
        }
        let shards = output
            .par_chunks_mut(SHARD * steps * outputs)
            .zip(input.par_chunks(SHARD * steps * inputs));
        shards.for_each(|(output, input)| {
            let batch = input.len() / (steps * inputs);
            let by_steps = self
                .layers
                .forward(swap_leading_axes(input, batch, steps, inputs), batch);
            output.copy_from_slice(&swap_leading_axes(&by_steps, steps, batch, outputs));
        });
        Ok(output)
    }
}

/// Each tensor uniform within its bound.
pub(crate) fn initial_weights(tensors: &[Tensor], seed: u64) -> Vec<f32> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut parameters = Vec::new();
    for tensor in tensors {
        let bound = tensor.initial_bound;
        parameters
            .extend((0..tensor.range.len()).map(|_| bound * random.random_range(-1.0_f32..1.0)));
    }
    parameters
}

pub(crate) fn check_input(
    input: &[f32],
    batch: usize,
    steps: usize,
    inputs: usize,
) -> Result<(), LearnedError> {
    let expected = batch.saturating_mul(steps).saturating_mul(inputs);
    if input.len() != expected {
        return Err(LearnedError::Input {
            found: input.len(),
            batch,
            steps,
            inputs,
            expected,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::testing::values;
    use crate::shape::Direction;

    fn shape(direction: Direction) -> NetworkShape {
        NetworkShape {
            inputs: 9,
            channels: 16,
            kernel: 5,
            convolutions: 3,
            hidden: 20,
            layers: 2,
            direction,
            outputs: 3,
        }
    }

    #[test]
    fn the_seed_decides_the_weights_within_their_bounds() {
        let network = Network::new(shape(Direction::Both), 3).unwrap();
        assert_eq!(network, Network::new(shape(Direction::Both), 3).unwrap());
        assert_ne!(network, Network::new(shape(Direction::Both), 4).unwrap());
        let spread = |name: &str| {
            network
                .tensor(name)
                .unwrap()
                .iter()
                .fold(0.0_f32, |spread, value| spread.max(value.abs()))
        };
        for (name, bound) in [
            ("conv.1.weight", (16.0_f32 * 5.0).powf(-0.5)),
            ("lstm.weight_hh_l1", 20.0_f32.powf(-0.5)),
        ] {
            assert!(
                spread(name) <= bound && spread(name) > 0.99 * bound,
                "{name}: {} of {bound}",
                spread(name)
            );
        }
        assert!(network.tensor("lstm.weight_ih_l2").is_none());
    }

    #[test]
    fn bits_depend_neither_on_threads_nor_on_the_batch() {
        let network = Network::new(shape(Direction::Both), 3).unwrap();
        let (batch, steps) = (35, 12);
        let input = values(batch * steps * 9, 1);
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| network.forward(&input, batch, steps).unwrap())
        };
        let whole = with_threads(1);
        assert_eq!(whole, with_threads(3));
        for (input, expected) in input.chunks(steps * 9).zip(whole.chunks(steps * 3)) {
            assert_eq!(network.forward(input, 1, steps).unwrap(), expected);
        }
    }

    #[test]
    fn a_forward_network_is_causal_and_the_other_is_not() {
        let (steps, changed) = (20, 11);
        let input = values(steps * 9, 1);
        let mut other = input.clone();
        other[changed * 9] += 1.0;
        for direction in [Direction::Forward, Direction::Both] {
            let network = Network::new(shape(direction), 3).unwrap();
            let (first, second) = (
                network.forward(&input, 1, steps).unwrap(),
                network.forward(&other, 1, steps).unwrap(),
            );
            assert_eq!(
                first[..changed * 3] == second[..changed * 3],
                direction == Direction::Forward,
                "{direction:?}"
            );
            assert_ne!(first[changed * 3..], second[changed * 3..]);
        }
    }

    #[test]
    fn a_wrong_length_is_refused_and_nothing_is_nothing() {
        let network = Network::new(shape(Direction::Both), 3).unwrap();
        let message = network.forward(&[0.0; 10], 2, 5).unwrap_err().to_string();
        assert_eq!(
            message,
            "network input: 10 numbers, 2 sequences x 5 steps x 9 inputs are 90"
        );
        assert_eq!(network.forward(&[], 0, 5).unwrap(), Vec::<f32>::new());
    }
}
