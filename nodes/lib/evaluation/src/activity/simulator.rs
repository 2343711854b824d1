//! How a motion becomes readings of a virtual device.

use serde::Serialize;

/// A way from a motion to readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Simulator {
    /// No skin: the nearest joint moves the sensor (IMUTube's way).
    Joint,
    /// The skin's point, by Richardson's differences.
    Analytic,
    /// Networks on the skin's points.
    Learned,
}

impl Simulator {
    /// All, in the order of the tables.
    pub const ALL: [Self; 3] = [Self::Joint, Self::Analytic, Self::Learned];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Analytic => "analytic",
            Self::Learned => "learned",
        }
    }

    /// The simulators of a run: without networks the learned one is left out, a quick run leaves
    /// out the joint's.
    pub(super) fn for_run(quick: bool, with_networks: bool) -> Vec<Self> {
        Self::ALL
            .into_iter()
            .filter(|simulator| *simulator != Self::Learned || with_networks)
            .filter(|simulator| *simulator != Self::Joint || !quick)
            .collect()
    }
}
