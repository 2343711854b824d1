//! What the library knows of each kind of effect, looked up; and effects made of it.

use std::fmt;

use super::kind::with_effects;
use super::search::{ReadOff, ReadOffSearch, Search};
use super::{Effect, EffectKind, EffectSet, EffectSpec, ParameterSpec, axis_convention};
use crate::EffectError;

macro_rules! table {
    ($($(#[$doc:meta])* $kind:ident => $file:ident::$spec:ident,)*) => {
        impl EffectKind {
            /// What the library knows about it.
            pub fn spec(self) -> &'static EffectSpec {
                match self {
                    $(Self::$kind => &super::$file::$spec,)*
                }
            }
        }
    };
}

with_effects!(table);

impl EffectKind {
    /// Name in files.
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// The effect of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The effect that is read off in this way.
    pub fn read_off(from: ReadOff) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.is_read_off(from))
    }

    /// Whether it is read off in this way.
    pub fn is_read_off(self, from: ReadOff) -> bool {
        matches!(self.spec().search, Search::ReadOff(search) if search.from == from)
    }

    /// Whether it rounds the readings.
    pub fn rounds(self) -> bool {
        matches!(
            self.spec().search,
            Search::ReadOff(ReadOffSearch {
                from: ReadOff::Lattice(_),
                ..
            })
        )
    }

    /// Whether a residual has other noise where it is known: noise of the sensor, rounding, and what
    /// makes the reference's own error larger.
    pub fn changes_predicted_noise(self) -> bool {
        let Search::ReadOff(search) = self.spec().search else {
            return false;
        };
        match search.from {
            ReadOff::Lattice(_)
            | ReadOff::ExcessNoise(_)
            | ReadOff::ReferenceScatter
            | ReadOff::ReferenceSpectrum
            | ReadOff::ReferenceFrames => true,
            ReadOff::ClippedReadings(_)
            | ReadOff::UnitFactor(_)
            | ReadOff::ReferenceLength
            | ReadOff::MissingMessages => false,
        }
    }
}

impl fmt::Display for EffectKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl Effect {
    /// An effect with flat values, matrices row by row, in the order of its parameters.
    ///
    /// # Errors
    /// [`EffectError`] for a wrong number of values, values that are not finite or out of bounds,
    /// an `axis_convention` that is no signed permutation.
    pub fn new(kind: EffectKind, values: Vec<f64>) -> Result<Self, EffectError> {
        match kind {
            EffectKind::AxisConvention => axis_convention::effect(values),
            _ => kind.spec().effect(values),
        }
    }

    /// The effect with values that change nothing.
    pub fn neutral(kind: EffectKind) -> Self {
        Self::from_checked(kind, kind.spec().neutral())
    }

    /// The same effect with other values.
    ///
    /// # Errors
    /// As [`Effect::new`].
    pub fn with_values(&self, values: Vec<f64>) -> Result<Self, EffectError> {
        Self::new(self.kind(), values)
    }

    /// Each parameter with its values.
    pub fn parameters(&self) -> impl Iterator<Item = (&'static ParameterSpec, &[f64])> {
        let mut rest = self.values();
        self.kind().spec().parameters.iter().map(move |parameter| {
            let (own, after) = rest.split_at(parameter.shape.count());
            rest = after;
            (parameter, own)
        })
    }

    /// The parameters that files hold: an optional one only where it is not neutral.
    pub fn written_parameters(&self) -> impl Iterator<Item = (&'static ParameterSpec, &[f64])> {
        self.parameters()
            .filter(|(parameter, values)| !parameter.is_optional || *values != parameter.neutral)
    }

    /// The values of one parameter.
    pub fn parameter(&self, name: &str) -> Option<&[f64]> {
        self.parameters()
            .find(|(parameter, _)| parameter.name == name)
            .map(|(_, values)| values)
    }
}

impl EffectSet {
    /// The effect that is read off in this way.
    pub fn get_read_off(&self, from: ReadOff) -> Option<&Effect> {
        EffectKind::read_off(from).and_then(|kind| self.get(kind))
    }
}

impl TryFrom<Vec<Effect>> for EffectSet {
    type Error = EffectError;

    /// Refuses a second effect of one kind.
    fn try_from(effects: Vec<Effect>) -> Result<Self, EffectError> {
        let mut set = Self::default();
        for effect in effects {
            let name = effect.kind().name();
            if set.insert(effect).is_some() {
                return Err(EffectError::Repeated { effect: name });
            }
        }
        Ok(set)
    }
}
