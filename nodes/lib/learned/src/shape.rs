//! What a network looks like, and where its weights lie.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::LearnedError;

/// The most parameters a network may have: 1 GiB of f32.
pub const MOST_PARAMETERS: u64 = 1 << 28;

/// Which way a network reads time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Bidirectional, with centred convolutions: every output knows the whole window.
    Both,
    /// Forward only, with causal convolutions: no output knows a later input, so that it runs live.
    Forward,
}

/// Convolutions with ReLU along time, LSTM layers, a linear layer at every step: (batch, steps,
/// inputs) -> (batch, steps, outputs).
///
/// The network that CROMOSim (Hao, Wang, Zheng) learns the gap with, its sizes free.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkShape {
    /// Numbers a step that go in.
    pub inputs: usize,
    /// Channels of every convolution.
    pub channels: usize,
    /// Taps of every convolution.
    pub kernel: usize,
    /// Convolutions; with none, the LSTM reads the input itself.
    pub convolutions: usize,
    /// Hidden units of an LSTM layer, per direction.
    pub hidden: usize,
    /// LSTM layers.
    pub layers: usize,
    /// Which way it reads time.
    pub direction: Direction,
    /// Numbers a step that come out.
    pub outputs: usize,
}

/// A tensor of a network.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    /// As PyTorch's modules `conv`, `lstm` and `linear` call it: `conv.0.weight`,
    /// `lstm.weight_ih_l0_reverse`.
    pub name: String,
    /// Its axes.
    pub shape: Vec<usize>,
    /// Where it lies among all parameters.
    pub range: Range<usize>,
    /// Initial values are uniform within this of 0: 1 / sqrt(numbers that go into a unit), as
    /// PyTorch does.
    pub(crate) initial_bound: f32,
}

/// Where the tensors of one LSTM direction lie.
#[derive(Debug, Clone)]
pub(crate) struct LstmPlace {
    pub input: Range<usize>,
    pub recurrent: Range<usize>,
    pub input_bias: Range<usize>,
    pub recurrent_bias: Range<usize>,
}

/// Where all tensors lie.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    /// Weight and bias.
    pub convolutions: Vec<(Range<usize>, Range<usize>)>,
    /// Layers, each with one direction or two.
    pub lstm: Vec<Vec<LstmPlace>>,
    pub linear: (Range<usize>, Range<usize>),
}

impl NetworkShape {
    /// 1 or 2.
    #[must_use]
    pub fn directions(&self) -> usize {
        match self.direction {
            Direction::Both => 2,
            Direction::Forward => 1,
        }
    }

    /// Numbers a step that go into the first LSTM layer.
    pub(crate) fn lstm_inputs(&self) -> usize {
        if self.convolutions == 0 {
            self.inputs
        } else {
            self.channels
        }
    }

    /// All numbers within their ranges, and no more parameters than [`MOST_PARAMETERS`].
    ///
    /// # Errors
    /// Where they are not; the message names the number.
    pub fn check(&self) -> Result<(), LearnedError> {
        let numbers = [
            ("inputs", self.inputs, 1, 65_536),
            ("channels", self.channels, 1, 16_384),
            ("kernel", self.kernel, 1, 255),
            ("convolutions", self.convolutions, 0, 64),
            ("hidden", self.hidden, 1, 16_384),
            ("layers", self.layers, 1, 64),
            ("outputs", self.outputs, 1, 65_536),
        ];
        check(&numbers, || self.tensors())
    }

    /// All parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.tensors().last().map_or(0, |tensor| tensor.range.end)
    }

    /// Every tensor, in the order in which they lie.
    #[must_use]
    pub fn tensors(&self) -> Vec<Tensor> {
        let mut list = TensorList::default();
        list.convolutions(self.inputs, self.channels, self.kernel, self.convolutions);
        list.recurrent(
            self.lstm_inputs(),
            self.hidden,
            self.layers,
            self.directions(),
        );
        list.linear(self.hidden * self.directions(), self.outputs);
        list.0
    }

    pub(crate) fn places(&self) -> Places {
        Places::from_tensors(
            self.tensors(),
            self.convolutions,
            self.layers,
            self.directions(),
        )
    }
}

impl Places {
    /// The places of tensors that stand in the order of convolutions, LSTM layers, linear layer.
    pub fn from_tensors(
        tensors: Vec<Tensor>,
        convolutions: usize,
        layers: usize,
        directions: usize,
    ) -> Self {
        let mut ranges = tensors.into_iter().map(|tensor| tensor.range);
        let mut next = || ranges.next().unwrap_or_default();
        Self {
            convolutions: (0..convolutions).map(|_| (next(), next())).collect(),
            lstm: (0..layers)
                .map(|_| {
                    (0..directions)
                        .map(|_| LstmPlace {
                            input: next(),
                            recurrent: next(),
                            input_bias: next(),
                            recurrent_bias: next(),
                        })
                        .collect()
                })
                .collect(),
            linear: (next(), next()),
        }
    }
}

/// Numbers (name, found, least, most) within their ranges, and no more parameters than
/// [`MOST_PARAMETERS`]; within the ranges no sum or product of the tensors' sizes may overflow.
pub(crate) fn check(
    numbers: &[(&'static str, usize, usize, usize)],
    tensors: impl FnOnce() -> Vec<Tensor>,
) -> Result<(), LearnedError> {
    for &(field, found, least, most) in numbers {
        if !(least..=most).contains(&found) {
            return Err(LearnedError::Shape {
                field,
                found,
                least,
                most,
            });
        }
    }
    let found: u64 = tensors()
        .iter()
        .map(|tensor| tensor.range.len() as u64)
        .sum();
    if found > MOST_PARAMETERS {
        return Err(LearnedError::TooLarge {
            found,
            most: MOST_PARAMETERS,
        });
    }
    Ok(())
}

fn bound(inputs: usize) -> f32 {
    1.0 / (inputs as f32).sqrt()
}

/// The tensors of a network in the making.
#[derive(Default)]
pub(crate) struct TensorList(pub Vec<Tensor>);

impl TensorList {
    fn push(&mut self, name: String, shape: &[usize], initial_bound: f32) {
        let start = self.0.last().map_or(0, |tensor| tensor.range.end);
        let range = start..start + shape.iter().product::<usize>();
        self.0.push(Tensor {
            name,
            shape: shape.to_vec(),
            range,
            initial_bound,
        });
    }

    /// `conv`: Conv1d layers.
    pub fn convolutions(&mut self, inputs: usize, channels: usize, kernel: usize, count: usize) {
        for index in 0..count {
            let inputs = if index == 0 { inputs } else { channels };
            let bound = bound(inputs * kernel);
            self.push(
                format!("conv.{index}.weight"),
                &[channels, inputs, kernel],
                bound,
            );
            self.push(format!("conv.{index}.bias"), &[channels], bound);
        }
    }

    /// `lstm`: one LSTM of several layers.
    pub fn recurrent(&mut self, inputs: usize, hidden: usize, layers: usize, directions: usize) {
        for layer in 0..layers {
            let inputs = if layer == 0 {
                inputs
            } else {
                hidden * directions
            };
            for suffix in ["", "_reverse"].into_iter().take(directions) {
                let (gates, bound) = (4 * hidden, bound(hidden));
                self.push(
                    format!("lstm.weight_ih_l{layer}{suffix}"),
                    &[gates, inputs],
                    bound,
                );
                self.push(
                    format!("lstm.weight_hh_l{layer}{suffix}"),
                    &[gates, hidden],
                    bound,
                );
                self.push(format!("lstm.bias_ih_l{layer}{suffix}"), &[gates], bound);
                self.push(format!("lstm.bias_hh_l{layer}{suffix}"), &[gates], bound);
            }
        }
    }

    /// `linear`: a Linear layer.
    pub fn linear(&mut self, inputs: usize, outputs: usize) {
        self.push(
            "linear.weight".to_owned(),
            &[outputs, inputs],
            bound(inputs),
        );
        self.push("linear.bias".to_owned(), &[outputs], bound(inputs));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn shape() -> NetworkShape {
        NetworkShape {
            inputs: 27,
            channels: 64,
            kernel: 5,
            convolutions: 3,
            hidden: 128,
            layers: 2,
            direction: Direction::Both,
            outputs: 3,
        }
    }

    #[test]
    fn counts_as_pytorch_does() {
        let convolutions = (27 * 64 * 5 + 64) + 2 * (64 * 64 * 5 + 64);
        let lstm = 2 * (512 * (64 + 128) + 1024) + 2 * (512 * (256 + 128) + 1024);
        assert_eq!(shape().parameters(), convolutions + lstm + 256 * 3 + 3);
        let names: Vec<String> = shape()
            .tensors()
            .into_iter()
            .map(|tensor| tensor.name)
            .collect();
        assert_eq!(names[0..2], ["conv.0.weight", "conv.0.bias"]);
        assert_eq!(names[14], "lstm.weight_ih_l1");
        assert_eq!(names[21], "lstm.bias_hh_l1_reverse");
    }

    #[test]
    fn refuses_what_cannot_be() {
        let message = |shape: NetworkShape| shape.check().unwrap_err().to_string();
        assert_eq!(
            message(NetworkShape {
                hidden: 0,
                ..shape()
            }),
            "network shape: hidden is 0, it may be 1 to 16384"
        );
        assert!(
            message(NetworkShape {
                inputs: usize::MAX,
                ..shape()
            })
            .contains("inputs")
        );
        assert!(
            message(NetworkShape {
                hidden: 16_384,
                ..shape()
            })
            .contains("parameters, at most 268435456")
        );
        assert!(
            shape().check().is_ok()
                && NetworkShape {
                    convolutions: 0,
                    ..shape()
                }
                .check()
                .is_ok()
        );
    }

    #[test]
    fn unknown_fields_are_refused() {
        let text = serde_json::to_string(&shape()).unwrap();
        assert_eq!(
            serde_json::from_str::<NetworkShape>(&text).unwrap(),
            shape()
        );
        assert!(serde_json::from_str::<NetworkShape>(&text.replace("kernel", "kernels")).is_err());
    }
}
