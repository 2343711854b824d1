//! `reference_units`: positions of the reference that are not in metres.

use super::search::{ReadOff, ReadOffSearch, Search};
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{EffectKind, EffectSet};
use crate::Channel;

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::ReferenceUnits,
    name: "reference_units",
    stage: Stage::Reference,
    owner: Owner::Session,
    summary: "Positions of the reference are not in metres: the simulated acceleration is the measured one times a known factor, while gravity and angular velocity agree.",
    remedy: "Convert the reference's positions to metres.",
    parameters: &[ParameterSpec {
        name: "factor",
        unit: "",
        shape: Shape::Scalar,
        neutral: &[1.0],
        is_optional: false,
        lower: 1e-6,
        upper: 1e6,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::ReadOff(ReadOffSearch {
        from: ReadOff::ReferenceLength,
        probability: 0.98,
    }),
};

/// Units per metre of positions: metres, millimetres, centimetres, decimetres, inches, feet, and the
/// inverse mistakes of millimetres and centimetres.
const LENGTH_FACTORS: [f64; 8] = [
    1.0,
    1000.0,
    100.0,
    10.0,
    39.370_078_740_157_48,
    3.280_839_895_013_123,
    0.001,
    0.01,
];

/// Known factors of the reference's units of length, 1 first.
pub fn length_factors() -> &'static [f64] {
    &LENGTH_FACTORS
}

impl EffectSet {
    /// Factor of the reference's units of length; 1 without the effect.
    pub fn length_factor(&self) -> f64 {
        self.get(EffectKind::ReferenceUnits)
            .map_or(1.0, |effect| effect.scalar(0))
    }
}
