//! What computes a training's gradients.

use cromosim_learned::train::{Engine, KernelEngine};
use serde::Deserialize;

use crate::EvaluationError;

/// The engine, as a training's file names it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EngineChoice {
    /// This suite's own: the same bits on any number of threads.
    #[default]
    Kernels,
    /// Burn on the CPU, its LSTM one operation of the kernels.
    Burn,
    /// Burn on the first NVIDIA GPU. Experimental: it type-checks, but was never run.
    Cuda,
}

impl EngineChoice {
    /// The engine.
    ///
    /// # Errors
    /// [`EvaluationError::EngineNotBuilt`] says how to build an engine that this program was built
    /// without.
    pub fn open(self) -> Result<Box<dyn Engine>, EvaluationError> {
        match self {
            Self::Kernels => Ok(Box::new(KernelEngine)),
            Self::Burn => burn(),
            Self::Cuda => cuda(),
        }
    }
}

#[cfg(feature = "burn")]
fn burn() -> Result<Box<dyn Engine>, EvaluationError> {
    Ok(Box::new(cromosim_learned::BurnEngine::cpu()))
}

#[cfg(not(feature = "burn"))]
fn burn() -> Result<Box<dyn Engine>, EvaluationError> {
    Err(EvaluationError::EngineNotBuilt {
        engine: "burn",
        library: "Burn",
    })
}

#[cfg(feature = "cuda")]
fn cuda() -> Result<Box<dyn Engine>, EvaluationError> {
    Ok(Box::new(cromosim_learned::BurnEngine::cuda(0)?))
}

#[cfg(not(feature = "cuda"))]
fn cuda() -> Result<Box<dyn Engine>, EvaluationError> {
    Err(EvaluationError::EngineNotBuilt {
        engine: "cuda",
        library: "CUDA",
    })
}
