//! A linear layer: y = x W^T + b.

use super::product::{PackedMatrix, View, add_product, add_rows, fill_rows};

/// A linear layer with its weights packed.
#[derive(Debug, Clone)]
pub struct Linear {
    inputs: usize,
    by_input: PackedMatrix,
    bias: Vec<f32>,
}

/// Gradients of a linear layer, in the shapes of its weights; what comes is added.
#[derive(Debug)]
pub struct LinearGradients<'a> {
    /// (outputs, inputs)
    pub weight: &'a mut [f32],
    /// (outputs)
    pub bias: &'a mut [f32],
}

impl Linear {
    /// weight: (outputs, inputs), bias: (outputs).
    #[must_use]
    pub fn new(weight: &[f32], bias: &[f32]) -> Self {
        let inputs = weight.len() / bias.len();
        Self {
            inputs,
            by_input: PackedMatrix::new(View::new(weight, bias.len(), inputs).transposed()),
            bias: bias.to_vec(),
        }
    }

    /// y = x W^T + b; input: (rows, inputs), output: (rows, outputs).
    pub fn forward_into(&self, input: &[f32], output: &mut [f32]) {
        fill_rows(output, &self.bias);
        add_product(
            output,
            View::new(input, input.len() / self.inputs, self.inputs),
            &self.by_input,
        );
    }

    /// As [`Linear::forward_into`], into memory of its own.
    #[must_use]
    pub fn forward(&self, input: &[f32]) -> Vec<f32> {
        let mut output = vec![0.0; input.len() / self.inputs * self.bias.len()];
        self.forward_into(input, &mut output);
        output
    }

    /// Adds dW = dY^T X and db = the sum of dY's rows, returns dX = dY W; weight: as given to
    /// [`Linear::new`].
    #[must_use]
    pub fn backward(
        &self,
        weight: &[f32],
        input: &[f32],
        output_gradient: &[f32],
        gradients: LinearGradients<'_>,
    ) -> Vec<f32> {
        let (inputs, outputs, rows) = (self.inputs, self.bias.len(), input.len() / self.inputs);
        let output_gradient_rows = View::new(output_gradient, rows, outputs);
        add_product(
            gradients.weight,
            output_gradient_rows.transposed(),
            &PackedMatrix::new(View::new(input, rows, inputs)),
        );
        add_rows(gradients.bias, output_gradient);
        let mut input_gradient = vec![0.0; input.len()];
        add_product(
            &mut input_gradient,
            output_gradient_rows,
            &PackedMatrix::new(View::new(weight, outputs, inputs)),
        );
        input_gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::testing::{check_gradient, values, weighted_sum};

    #[test]
    fn gradients_agree_with_differences() {
        let (rows, inputs, outputs) = (7, 5, 3);
        let (input, weight, bias, along) = (
            values(rows * inputs, 1),
            values(outputs * inputs, 2),
            values(outputs, 3),
            values(rows * outputs, 4),
        );
        let loss = |input: &[f32], weight: &[f32], bias: &[f32]| {
            weighted_sum(&Linear::new(weight, bias).forward(input), &along)
        };
        let (mut of_weight, mut of_bias) = (vec![0.0; weight.len()], vec![0.0; bias.len()]);
        let gradients = LinearGradients {
            weight: &mut of_weight,
            bias: &mut of_bias,
        };
        let of_input = Linear::new(&weight, &bias).backward(&weight, &input, &along, gradients);
        check_gradient("input", &input, &of_input, |input| {
            loss(input, &weight, &bias)
        });
        check_gradient("weight", &weight, &of_weight, |weight| {
            loss(&input, weight, &bias)
        });
        check_gradient("bias", &bias, &of_bias, |bias| loss(&input, &weight, bias));
    }
}
