//! Training by Burn's automatic differentiation, for its other backends: on its CPU backend the
//! LSTM is one fused operation of our kernels, elsewhere it is made of Burn's own.
//!
//! Weights stay in [`Network`], in its order; each batch takes them to the device and brings
//! gradients back, so that Adam, checkpoints and files are those of [`crate::train`].

mod fused;
mod model;

use ::burn::tensor::{Device, Tensor, TensorData};

use crate::train::{Batch, Engine, Loss, weighted_loss};
use crate::{LearnedError, Network};
use model::{Model, numbers};

/// Burn, on a device of its.
#[derive(Debug, Clone)]
pub struct BurnEngine {
    device: Device,
    fused: bool,
}

impl BurnEngine {
    /// On the CPU, the LSTM fused.
    #[must_use]
    pub fn cpu() -> Self {
        Self {
            device: Device::flex(),
            fused: true,
        }
    }

    /// On the CPU, all of it made of Burn's own operations: what runs on other devices, for
    /// comparison.
    #[must_use]
    pub fn cpu_composed() -> Self {
        Self {
            device: Device::flex(),
            fused: false,
        }
    }

    /// On an NVIDIA GPU; index: which, from 0 on.
    ///
    /// # Errors
    /// [`LearnedError::Burn`] where Burn finds none (it panics, and prints why).
    #[cfg(feature = "cuda")]
    pub fn cuda(index: usize) -> Result<Self, LearnedError> {
        let device = std::panic::catch_unwind(|| {
            let device = Device::cuda(index);
            Tensor::<1>::zeros([1], &device).into_data();
            device
        });
        let missing = |_| LearnedError::Burn {
            reason: format!("no NVIDIA GPU {index}; `engine: burn` runs on the CPU"),
        };
        Ok(Self {
            device: device.map_err(missing)?,
            fused: false,
        })
    }

    fn input(&self, network: &Network, batch: &Batch, device: &Device) -> Tensor<3> {
        let data = TensorData::new(
            batch.inputs.clone(),
            [batch.sequences, batch.steps, network.shape().inputs],
        );
        Tensor::from_data(data, device)
    }
}

impl Engine for BurnEngine {
    fn gradients(
        &mut self,
        network: &Network,
        batch: &Batch,
        losses: &[Loss],
        gradients: &mut [f32],
    ) -> Result<f64, LearnedError> {
        let device = self.device.clone().autodiff();
        let model = Model::new(network, &device, self.fused);
        let output = model.forward(self.input(network, batch, &device));
        let dimensions = output.dims();
        let values = numbers(output.clone().inner())?;
        let scale = 1.0 / (network.shape().outputs as f64 * batch.total_weight());
        let mut slopes = vec![0.0; values.len()];
        let sum = weighted_loss(
            losses,
            (&values, &batch.targets, &batch.weights),
            Some((&mut slopes, scale)),
        );
        // The loss is ours; its slopes times the outputs have the same gradient.
        let slopes = Tensor::from_data(TensorData::new(slopes, dimensions), &device);
        let found = (output * slopes).sum().backward();
        model.gradients(&found, gradients)?;
        Ok(sum * scale)
    }

    fn loss_sum(
        &mut self,
        network: &Network,
        batch: &Batch,
        losses: &[Loss],
    ) -> Result<f64, LearnedError> {
        let output = Model::new(network, &self.device, self.fused).forward(self.input(
            network,
            batch,
            &self.device,
        ));
        Ok(weighted_loss(
            losses,
            (&numbers(output)?, &batch.targets, &batch.weights),
            None,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::testing::values;
    use crate::train::KernelEngine;
    use crate::{Direction, NetworkShape};

    #[test]
    fn gradients_are_those_of_the_kernels() {
        for (direction, kernel) in [(Direction::Both, 4), (Direction::Forward, 3)] {
            let shape = NetworkShape {
                inputs: 5,
                channels: 6,
                kernel,
                convolutions: 2,
                hidden: 9,
                layers: 2,
                direction,
                outputs: 3,
            };
            let network = Network::new(shape, 1).unwrap();
            let (sequences, steps) = (4, 8);
            let weights = values(sequences * steps, 4)
                .iter()
                .map(|weight| weight.max(0.0))
                .collect();
            let (inputs, targets) = (
                values(sequences * steps * 5, 2),
                values(sequences * steps * 3, 3),
            );
            let batch = Batch {
                inputs,
                targets,
                weights,
                sequences,
                steps,
            };
            let losses = [Loss::Huber { delta: 0.4 }];
            let mut expected = vec![0.0; network.parameters().len()];
            let loss = KernelEngine
                .gradients(&network, &batch, &losses, &mut expected)
                .unwrap();
            for mut engine in [BurnEngine::cpu(), BurnEngine::cpu_composed()] {
                let mut found = vec![f32::NAN; expected.len()];
                let loss_found = engine
                    .gradients(&network, &batch, &losses, &mut found)
                    .unwrap();
                assert!((loss_found - loss).abs() < 1e-6);
                let sum = engine.loss_sum(&network, &batch, &losses).unwrap();
                assert!(
                    (sum - KernelEngine.loss_sum(&network, &batch, &losses).unwrap()).abs() < 1e-5
                );
                for tensor in network.shape().tensors() {
                    let worst = tensor
                        .range
                        .clone()
                        .map(|index| (found[index] - expected[index]).abs())
                        .fold(0.0, f32::max);
                    assert!(
                        worst < 1e-6,
                        "{engine:?}, {direction:?}, {}: {worst}",
                        tensor.name
                    );
                }
            }
        }
    }
}
