//! `dropped_samples`: messages are lost, in bursts.

use rand_chacha::ChaCha12Rng;

use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind};
use crate::{Channel, random};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::DroppedSamples,
    name: "dropped_samples",
    stage: Stage::Timing,
    owner: Owner::Session,
    summary: "Messages are lost: the stamps have gaps of whole intervals, the readings that are there stay right.",
    remedy: "Find the loss (radio, queue sizes, bandwidth), or log on the device.",
    parameters: &[
        ParameterSpec {
            name: "fraction",
            unit: "",
            shape: Shape::Scalar,
            neutral: &[0.0],
            is_optional: false,
            lower: 0.0,
            upper: 0.99,
            fit: None,
        },
        ParameterSpec {
            name: "mean_burst",
            unit: "samples",
            shape: Shape::Scalar,
            neutral: &[1.0],
            is_optional: false,
            lower: 1.0,
            upper: 1e6,
            fit: None,
        },
    ],
    channels: &Channel::ALL,
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::MissingMessages,
        probability: 0.98,
    }),
};

/// Which samples are lost: a chain of two states (Gilbert 1960). A burst goes on with probability 1
/// - 1/mean_burst, and begins so often that the fraction comes out.
#[derive(Clone, Debug)]
pub struct Dropouts {
    begins: f64,
    ends: f64,
    lost: bool,
    random: ChaCha12Rng,
}

impl Dropouts {
    /// The losses of one placement; none where the effect is none. The same seed and name lose the
    /// same samples.
    pub fn new(effect: Option<&Effect>, seed: u64, placement: &str) -> Option<Self> {
        let (fraction, mean_burst) = (effect?.scalar(0), effect?.scalar(1));
        let ends = mean_burst.recip();
        let begins = (ends * fraction / (1.0 - fraction)).min(1.0);
        (fraction > 0.0).then(|| Self {
            begins,
            ends,
            lost: false,
            random: random::stream(seed, placement, random::DROPOUT_CHANNEL),
        })
    }

    /// Whether the next sample is lost.
    pub fn next_is_lost(&mut self) -> bool {
        let chance = random::uniform(&mut self.random);
        self.lost = if self.lost {
            chance >= self.ends
        } else {
            chance < self.begins
        };
        self.lost
    }
}
