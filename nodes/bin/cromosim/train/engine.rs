//! What computes a training's gradients.

use cromosim_learned::train::{Engine, KernelEngine};
use serde::Deserialize;

/// As in a training's file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Choice {
    /// This suite's own: the same bits on any number of threads.
    #[default]
    Kernels,
    /// Burn on the CPU, its LSTM one operation of the kernels.
    Burn,
    /// Burn on the first NVIDIA GPU.
    Cuda,
}

impl Choice {
    /// The engine; an error says how to build one that this program was built without.
    pub fn open(self) -> anyhow::Result<Box<dyn Engine>> {
        match self {
            Self::Kernels => Ok(Box::new(KernelEngine)),
            Self::Burn => burn(),
            Self::Cuda => cuda(),
        }
    }
}

#[cfg(feature = "burn")]
fn burn() -> anyhow::Result<Box<dyn Engine>> {
    Ok(Box::new(cromosim_learned::BurnEngine::cpu()))
}

#[cfg(not(feature = "burn"))]
fn burn() -> anyhow::Result<Box<dyn Engine>> {
    anyhow::bail!(
        "training: engine burn: this program was built without Burn; build it by `cargo build --features burn`"
    )
}

#[cfg(feature = "cuda")]
fn cuda() -> anyhow::Result<Box<dyn Engine>> {
    Ok(Box::new(cromosim_learned::BurnEngine::cuda(0)?))
}

#[cfg(not(feature = "cuda"))]
fn cuda() -> anyhow::Result<Box<dyn Engine>> {
    anyhow::bail!(
        "training: engine cuda: this program was built without CUDA; build it by `cargo build --features cuda`"
    )
}
