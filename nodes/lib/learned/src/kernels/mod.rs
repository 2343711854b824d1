//! The layers as functions of f32 slices, forward and backward, on one thread.
//!
//! Sequences lie time-major, (steps, batch, width), so that a step of all sequences is one matrix
//! and a convolution's tap a shifted one. Every sum runs in an order that neither the processor's
//! vector width nor the batch nor the number of threads decides, and every multiply-add rounds
//! once: the same numbers go in, the same bits come out, with AVX2, AVX-512, NEON or none of them.
//!
//! The slices' lengths are the caller's duty (`Network` checks them once): a wrong one panics.

mod convolution;
mod functions;
mod linear;
mod lstm;
mod product;
#[cfg(test)]
pub(crate) mod testing;

pub use convolution::{Convolution, ConvolutionGradients, Padding, relu, relu_backward};
pub use functions::{sigmoid, tanh};
pub use linear::{Linear, LinearGradients};
pub use lstm::{Lstm, LstmGradients, LstmState, LstmTape, LstmWeights, Order};
pub use product::{PackedMatrix, View, add_product, add_rows, fill_rows};

/// Swaps the first two axes: (first, second, width) -> (second, first, width). Batch-major to
/// time-major, and back.
#[must_use]
pub fn swap_leading_axes(values: &[f32], first: usize, second: usize, width: usize) -> Vec<f32> {
    assert_eq!(values.len(), first * second * width);
    let mut swapped = Vec::with_capacity(values.len());
    for inner in 0..second {
        for outer in 0..first {
            swapped.extend_from_slice(&values[(outer * second + inner) * width..][..width]);
        }
    }
    swapped
}
