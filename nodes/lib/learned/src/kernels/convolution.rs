//! Convolution along time, as PyTorch's Conv1d: y_t = b + sum over taps k of W_k x_(t + k - left).

use serde::{Deserialize, Serialize};

use super::product::{PackedMatrix, View, add_product, add_rows, fill_rows};

/// What stands before the first and behind the last step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Padding {
    /// Zeros on both sides, (kernel - 1) / 2 before: as many steps come out as go in.
    Same,
    /// kernel - 1 zeros before: no output knows a later input.
    Causal,
    /// None: kernel - 1 fewer steps come out.
    None,
}

impl Padding {
    /// Zeros before the first step, and behind the last.
    #[must_use]
    pub fn steps(self, kernel: usize) -> (usize, usize) {
        match self {
            Self::Same => ((kernel - 1) / 2, kernel / 2),
            Self::Causal => (kernel - 1, 0),
            Self::None => (0, 0),
        }
    }

    /// Steps that come out of as many that go in.
    #[must_use]
    pub fn steps_out(self, kernel: usize, steps: usize) -> usize {
        let (before, behind) = self.steps(kernel);
        (steps + before + behind).saturating_sub(kernel - 1)
    }
}

/// A convolution with its weights packed.
#[derive(Debug, Clone)]
pub struct Convolution {
    inputs: usize,
    padding: Padding,
    /// One matrix (inputs, outputs) a tap.
    taps: Vec<PackedMatrix>,
    bias: Vec<f32>,
}

/// Gradients of a convolution, in the shapes of its weights; what comes is added.
#[derive(Debug)]
pub struct ConvolutionGradients<'a> {
    /// (outputs, inputs, kernel)
    pub weight: &'a mut [f32],
    /// (outputs)
    pub bias: &'a mut [f32],
}

impl Convolution {
    /// weight: (outputs, inputs, kernel), bias: (outputs).
    #[must_use]
    pub fn new(weight: &[f32], bias: &[f32], kernel: usize, padding: Padding) -> Self {
        let inputs = weight.len() / (bias.len() * kernel);
        let tap = |tap| {
            PackedMatrix::new(View::strided(
                &weight[tap..],
                inputs,
                bias.len(),
                kernel,
                inputs * kernel,
            ))
        };
        Self {
            inputs,
            padding,
            taps: (0..kernel).map(tap).collect(),
            bias: bias.to_vec(),
        }
    }

    /// The matrices of the taps, (inputs, outputs) each, the earliest first, and the bias.
    pub(crate) fn parts(&self) -> (&[PackedMatrix], &[f32]) {
        (&self.taps, &self.bias)
    }

    /// For a tap: the first step that it reaches, the first that it reads, and how many there are;
    /// nothing where all it reads is padding.
    fn reach(&self, tap: usize, steps: usize) -> Option<(usize, usize, usize)> {
        let (before, _) = self.padding.steps(self.taps.len());
        let (to, from) = (before.saturating_sub(tap), tap.saturating_sub(before));
        let out = self.padding.steps_out(self.taps.len(), steps);
        let count = out.saturating_sub(to).min(steps.saturating_sub(from));
        (count > 0).then_some((to, from, count))
    }

    /// input: (steps, batch, inputs) -> (steps out, batch, outputs).
    #[must_use]
    pub fn forward(&self, input: &[f32], batch: usize) -> Vec<f32> {
        let (wide_in, wide_out) = (batch * self.inputs, batch * self.bias.len());
        let steps = input.len() / wide_in;
        let mut output = vec![0.0; self.padding.steps_out(self.taps.len(), steps) * wide_out];
        fill_rows(&mut output, &self.bias);
        for (tap, matrix) in self.taps.iter().enumerate() {
            let Some((to, from, count)) = self.reach(tap, steps) else {
                continue;
            };
            let input = View::new(
                &input[from * wide_in..][..count * wide_in],
                count * batch,
                self.inputs,
            );
            add_product(
                &mut output[to * wide_out..][..count * wide_out],
                input,
                matrix,
            );
        }
        output
    }

    /// Adds the gradients of weight and bias, returns that of the input; weight: as given to
    /// [`Convolution::new`].
    #[must_use]
    pub fn backward(
        &self,
        weight: &[f32],
        input: &[f32],
        output_gradient: &[f32],
        batch: usize,
        gradients: ConvolutionGradients<'_>,
    ) -> Vec<f32> {
        let (inputs, outputs, kernel) = (self.inputs, self.bias.len(), self.taps.len());
        let (wide_in, wide_out) = (batch * inputs, batch * outputs);
        let steps = input.len() / wide_in;
        let (before, behind) = self.padding.steps(kernel);
        let mut padded = vec![0.0; (before + steps + behind) * wide_in];
        padded[before * wide_in..][..input.len()].copy_from_slice(input);
        let rows = output_gradient.len() / outputs;
        let packed_gradient = PackedMatrix::new(View::new(output_gradient, rows, outputs));
        let mut input_gradient = vec![0.0; input.len()];
        let mut of_tap = vec![0.0; inputs * outputs];
        for tap in 0..kernel {
            let Some((to, from, count)) = self.reach(tap, steps) else {
                continue;
            };
            let gradient = View::new(
                &output_gradient[to * wide_out..][..count * wide_out],
                count * batch,
                outputs,
            );
            let back = PackedMatrix::new(View::strided(
                &weight[tap..],
                outputs,
                inputs,
                inputs * kernel,
                kernel,
            ));
            add_product(
                &mut input_gradient[from * wide_in..][..count * wide_in],
                gradient,
                &back,
            );
            of_tap.fill(0.0);
            let seen = View::new(&padded[tap * wide_in..][..rows * inputs], rows, inputs);
            add_product(&mut of_tap, seen.transposed(), &packed_gradient);
            for (index, added) in of_tap.iter().enumerate() {
                let (input, output) = (index / outputs, index % outputs);
                gradients.weight[(output * inputs + input) * kernel + tap] += added;
            }
        }
        add_rows(gradients.bias, output_gradient);
        input_gradient
    }
}

/// x becomes max(x, 0); NaN stays.
pub fn relu(values: &mut [f32]) {
    values
        .iter_mut()
        .filter(|value| **value < 0.0)
        .for_each(|value| *value = 0.0);
}

/// The gradient behind [`relu`] becomes the one before it: 0 where the output is 0.
pub fn relu_backward(output: &[f32], gradient: &mut [f32]) {
    gradient
        .iter_mut()
        .zip(output)
        .for_each(|(gradient, output)| *gradient = if *output == 0.0 { 0.0 } else { *gradient });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::testing::{check_gradient, values, weighted_sum};

    const BATCH: usize = 3;
    const INPUTS: usize = 4;
    const OUTPUTS: usize = 5;

    /// The definition, in f64.
    fn by_definition(
        input: &[f32],
        weight: &[f32],
        bias: &[f32],
        kernel: usize,
        padding: Padding,
    ) -> Vec<f64> {
        let steps = input.len() / (BATCH * INPUTS);
        let before = padding.steps(kernel).0 as isize;
        let mut output = Vec::new();
        for (step, sequence, channel) in (0..padding.steps_out(kernel, steps)).flat_map(|step| {
            (0..BATCH * OUTPUTS).map(move |index| (step, index / OUTPUTS, index % OUTPUTS))
        }) {
            let mut sum = f64::from(bias[channel]);
            for tap in 0..kernel {
                let from = step as isize + tap as isize - before;
                if (0..steps as isize).contains(&from) {
                    for index in 0..INPUTS {
                        let value = input[(from as usize * BATCH + sequence) * INPUTS + index];
                        sum += f64::from(value)
                            * f64::from(weight[(channel * INPUTS + index) * kernel + tap]);
                    }
                }
            }
            output.push(sum);
        }
        output
    }

    #[test]
    fn agrees_with_the_definition() {
        for (steps, kernel) in [(9, 5), (9, 4), (2, 5), (1, 1), (6, 3)] {
            for padding in [Padding::Same, Padding::Causal, Padding::None] {
                let (input, weight, bias) = (
                    values(steps * BATCH * INPUTS, 1),
                    values(OUTPUTS * INPUTS * kernel, 2),
                    values(OUTPUTS, 3),
                );
                let found =
                    Convolution::new(&weight, &bias, kernel, padding).forward(&input, BATCH);
                let expected = by_definition(&input, &weight, &bias, kernel, padding);
                assert_eq!(
                    found.len(),
                    expected.len(),
                    "{padding:?}, {steps} steps, kernel {kernel}"
                );
                assert!(
                    found
                        .iter()
                        .zip(&expected)
                        .all(|(found, expected)| (f64::from(*found) - expected).abs() < 1e-5)
                );
            }
        }
    }

    #[test]
    fn gradients_agree_with_differences() {
        for (padding, kernel) in [
            (Padding::Same, 5),
            (Padding::Same, 2),
            (Padding::Causal, 3),
            (Padding::None, 3),
        ] {
            let steps = 6;
            let (input, weight, bias) = (
                values(steps * BATCH * INPUTS, 1),
                values(OUTPUTS * INPUTS * kernel, 2),
                values(OUTPUTS, 3),
            );
            let along = values(padding.steps_out(kernel, steps) * BATCH * OUTPUTS, 4);
            let loss = |input: &[f32], weight: &[f32], bias: &[f32]| {
                weighted_sum(
                    &Convolution::new(weight, bias, kernel, padding).forward(input, BATCH),
                    &along,
                )
            };
            let (mut of_weight, mut of_bias) = (vec![0.0; weight.len()], vec![0.0; bias.len()]);
            let gradients = ConvolutionGradients {
                weight: &mut of_weight,
                bias: &mut of_bias,
            };
            let of_input = Convolution::new(&weight, &bias, kernel, padding)
                .backward(&weight, &input, &along, BATCH, gradients);
            check_gradient("input", &input, &of_input, |input| {
                loss(input, &weight, &bias)
            });
            check_gradient("weight", &weight, &of_weight, |weight| {
                loss(&input, weight, &bias)
            });
            check_gradient("bias", &bias, &of_bias, |bias| loss(&input, &weight, bias));
        }
    }

    #[test]
    fn relu_lets_nan_and_positive_gradients_through() {
        let mut values = [-1.0, 0.5, f32::NAN, 0.0];
        relu(&mut values);
        assert!(values[0] == 0.0 && values[1] == 0.5 && values[2].is_nan() && values[3] == 0.0);
        let mut gradient = [1.0, 2.0, 3.0, 4.0];
        relu_backward(&values, &mut gradient);
        assert_eq!(gradient, [0.0, 2.0, 3.0, 0.0]);
    }
}
