//! Loss and gradients of a batch.

use rayon::prelude::*;

use super::batch::Batch;
use super::loss::{Loss, weighted_loss};
use crate::kernels::swap_leading_axes;
use crate::network::{PreparedNetwork, SHARD};
use crate::{LearnedError, Network};

/// What computes gradients. The loss is the weighted mean over steps of the mean over channels:
/// sum of weight x loss / (channels x sum of weights).
pub trait Engine {
    /// The loss, and its gradient in `gradients` in the order of [`crate::NetworkShape::tensors`];
    /// what was there is overwritten.
    ///
    /// # Errors
    /// Where the engine fails.
    fn gradients(
        &mut self,
        network: &Network,
        batch: &Batch,
        losses: &[Loss],
        gradients: &mut [f32],
    ) -> Result<f64, LearnedError>;

    /// Weighted sum of the losses (not divided), without gradients.
    ///
    /// # Errors
    /// Where the engine fails.
    fn loss_sum(
        &mut self,
        network: &Network,
        batch: &Batch,
        losses: &[Loss],
    ) -> Result<f64, LearnedError>;
}

/// The kernels of this crate, on rayon's threads: a batch is cut into shards of fixed size whose
/// gradients are added in order, so that the bits do not depend on how many threads there are.
#[derive(Debug, Clone, Copy, Default)]
pub struct KernelEngine;

/// At most this many shards, so that their gradients do not fill the memory.
const MOST_SHARDS: usize = 16;

impl Engine for KernelEngine {
    fn gradients(
        &mut self,
        network: &Network,
        batch: &Batch,
        losses: &[Loss],
        gradients: &mut [f32],
    ) -> Result<f64, LearnedError> {
        let prepared = network.prepare();
        let (inputs, outputs) = (network.shape().inputs, network.shape().outputs);
        let scale = 1.0 / (outputs as f64 * batch.total_weight());
        let sequences = SHARD.max(batch.sequences.div_ceil(MOST_SHARDS));
        let rows = sequences * batch.steps;
        let shards = batch
            .inputs
            .par_chunks(rows * inputs)
            .zip(batch.targets.par_chunks(rows * outputs))
            .zip(batch.weights.par_chunks(rows));
        let shards: Vec<(f64, Vec<f32>)> = shards
            .map(|((inputs, targets), weights)| {
                shard_gradients(
                    network,
                    &prepared,
                    (inputs, targets, weights),
                    batch.steps,
                    (losses, scale),
                )
            })
            .collect();
        let mut sum = 0.0;
        gradients.fill(0.0);
        for (loss, of_shard) in &shards {
            sum += loss;
            gradients
                .iter_mut()
                .zip(of_shard)
                .for_each(|(sum, gradient)| *sum += gradient);
        }
        Ok(sum * scale)
    }

    fn loss_sum(
        &mut self,
        network: &Network,
        batch: &Batch,
        losses: &[Loss],
    ) -> Result<f64, LearnedError> {
        let output = network.forward(&batch.inputs, batch.sequences, batch.steps)?;
        Ok(weighted_loss(
            losses,
            (&output, &batch.targets, &batch.weights),
            None,
        ))
    }
}

fn shard_gradients(
    network: &Network,
    prepared: &PreparedNetwork,
    (inputs, targets, weights): (&[f32], &[f32], &[f32]),
    steps: usize,
    (losses, scale): (&[Loss], f64),
) -> (f64, Vec<f32>) {
    let shape = network.shape();
    let batch = weights.len() / steps;
    let by_steps = |values: &[f32], width: usize| swap_leading_axes(values, batch, steps, width);
    let (output, tape) = prepared
        .layers
        .forward_with_tape(by_steps(inputs, shape.inputs), batch);
    let mut output_gradient = vec![0.0; output.len()];
    let (targets, weights) = (by_steps(targets, shape.outputs), by_steps(weights, 1));
    let loss = weighted_loss(
        losses,
        (&output, &targets, &weights),
        Some((&mut output_gradient, scale)),
    );
    let mut gradients = vec![0.0; network.parameters().len()];
    let _ = prepared.layers.backward(
        network.parameters(),
        &tape,
        &output_gradient,
        batch,
        &mut gradients,
    );
    (loss, gradients)
}
