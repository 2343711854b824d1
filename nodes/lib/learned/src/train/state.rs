//! What a training consists of.

use super::adam::Adam;
use super::options::TrainOptions;
use crate::{LearnedError, Network, NetworkShape};

/// The weights that validated best.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// Them.
    pub network: Network,
    /// After which step.
    pub step: u64,
    /// Their validation loss.
    pub loss: f64,
}

/// A training with all that its next step depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Training {
    pub(super) options: TrainOptions,
    pub(super) network: Network,
    pub(super) adam: Adam,
    pub(super) step: u64,
    pub(super) best: Option<Best>,
    /// Validations since the best.
    pub(super) stale: u64,
}

impl Training {
    /// A new one, its weights from the options' seed.
    ///
    /// # Errors
    /// Where shape or options are not sound.
    pub fn new(shape: NetworkShape, options: TrainOptions) -> Result<Self, LearnedError> {
        let seed = options.seed;
        Self::from_network(Network::new(shape, seed)?, options)
    }

    /// A new one that begins with the weights of a network, to train it further.
    ///
    /// # Errors
    /// Where the options are not sound.
    pub fn from_network(network: Network, options: TrainOptions) -> Result<Self, LearnedError> {
        options.check(network.shape())?;
        let adam = Adam::new(network.parameters().len());
        Ok(Self {
            options,
            network,
            adam,
            step: 0,
            best: None,
            stale: 0,
        })
    }

    /// Steps taken.
    #[must_use]
    pub fn step(&self) -> u64 {
        self.step
    }

    /// The weights after the last step.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The weights that validated best, where there was a validation.
    #[must_use]
    pub fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    /// The network to keep: the best where there was a validation, else the last.
    #[must_use]
    pub fn into_network(self) -> Network {
        self.best.map_or(self.network, |best| best.network)
    }
}
