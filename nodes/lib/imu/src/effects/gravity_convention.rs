//! `gravity_convention`: what a device calls acceleration.

use super::search::Search;
use super::spec::{EffectSpec, Owner, ParameterSpec, Shape, Stage};
use super::{Effect, EffectKind};
use crate::{Channel, EffectError};

pub(super) static SPEC: EffectSpec = EffectSpec {
    kind: EffectKind::GravityConvention,
    name: "gravity_convention",
    stage: Stage::Segment,
    owner: Owner::Device,
    summary: "The device reports acceleration without gravity, or with gravity's sign turned: the residual is one or two g along the vertical.",
    remedy: "Switch the driver to specific force (+g upwards at rest, as REP-145 asks), or convert the readings.",
    parameters: &[ParameterSpec {
        name: "mode",
        unit: "",
        // What the contract asks for comes first, so that a neutral value exists.
        shape: Shape::Choice(&["kept", "removed", "negated"]),
        neutral: &[0.0],
        is_optional: false,
        lower: 0.0,
        upper: 2.0,
        fit: None,
    }],
    channels: &[Channel::Accelerometer],
    search: Search::Choice,
};

/// What a device makes of gravity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GravityMode {
    /// Specific force, as the contract asks.
    Kept,
    /// Acceleration.
    Removed,
    /// Specific force with gravity's sign turned.
    Negated,
}

impl GravityMode {
    /// All of them, in the order of the parameter's words.
    pub const ALL: [Self; 3] = [Self::Kept, Self::Removed, Self::Negated];

    /// The parameter's value: the number of the word.
    fn value(self) -> f64 {
        self as u8 as f64
    }

    /// c in `f = R^T (a - c g)`.
    pub fn factor(self) -> f64 {
        gravity_factor(self.value())
    }
}

/// c in `f = R^T (a - c g)` by the parameter's value: 1 kept, 0 removed, -1 negated.
pub(super) fn gravity_factor(mode: f64) -> f64 {
    1.0 - mode
}

impl Effect {
    /// A device that makes this of gravity.
    ///
    /// # Errors
    /// None: every mode is within the bounds.
    pub fn gravity_convention(mode: GravityMode) -> Result<Self, EffectError> {
        SPEC.effect(vec![mode.value()])
    }
}
