//! What a classifier learns from: the conditions that are compared.

use serde::Serialize;

use super::simulator::Simulator;

/// What is learned from. Tested is always on real devices of people who were not learned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum TrainingData {
    /// Real windows.
    #[serde(rename = "R2R")]
    Real,
    /// Real windows and the same turned, half of every batch each: what drawn ways of wearing
    /// devices give without any virtual ones.
    #[serde(rename = "R2R, turned")]
    Turned,
    /// Virtual windows.
    #[serde(rename = "V2R")]
    Virtual,
    /// Real and virtual windows, half of every batch each.
    #[serde(rename = "Mix2R")]
    Mixed,
}

impl TrainingData {
    /// The paper's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Real => "R2R",
            Self::Turned => "R2R, turned",
            Self::Virtual => "V2R",
            Self::Mixed => "Mix2R",
        }
    }
}

/// How virtual windows are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Variant {
    /// How motions become readings.
    pub simulator: Simulator,
    /// Their distributions are mapped to real ones.
    pub mapped: bool,
    /// The root does not travel (Lite).
    pub in_place: bool,
    /// Noise, biases, resolution and stamps are those estimated of the real devices.
    pub effects: bool,
}

impl Variant {
    /// The simulator alone.
    pub const fn plain(simulator: Simulator) -> Self {
        Self {
            simulator,
            mapped: false,
            in_place: false,
            effects: false,
        }
    }

    /// With the distribution mapping.
    pub const fn mapped(simulator: Simulator) -> Self {
        Self {
            mapped: true,
            ..Self::plain(simulator)
        }
    }

    /// The simulator's four: plain, mapped, in place, with effects.
    pub fn all_with(simulator: Simulator) -> [Self; 4] {
        let plain = Self::plain(simulator);
        [
            plain,
            Self::mapped(simulator),
            Self {
                in_place: true,
                ..plain
            },
            Self {
                effects: true,
                ..plain
            },
        ]
    }

    /// Whether real readings are needed to make it.
    pub fn sees_real(self) -> bool {
        self.mapped || self.effects
    }

    /// What is done beside the simulator.
    pub fn addition(self) -> &'static str {
        match (self.mapped, self.in_place, self.effects) {
            (false, false, false) => "plain",
            (true, false, false) => "distribution mapping",
            (false, true, false) => "in place (Lite)",
            (false, false, true) => "device effects",
            _ => "several",
        }
    }

    /// The name in tables.
    pub fn name(self) -> String {
        format!("{}, {}", self.simulator.name(), self.addition())
    }
}

/// What one training learns from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Condition {
    /// Real windows, virtual ones, or both.
    pub training: TrainingData,
    /// How virtual windows are made; none without them.
    pub variant: Option<Variant>,
    /// Share of the training subjects, above 0 to 1.
    pub share: f64,
}
