//! What the library knows about each effect.

use super::search::Search;
use super::{Effect, EffectKind};
use crate::{Channel, EffectError};

/// Where in the measurement an effect acts, see [`crate::effects`] for the equations; effects of a
/// stage leave the results of the stages before it as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// In the reference, not in the device: undone before the others run.
    Reference,
    /// Specific force of the rigid segment, on the motion's grid.
    Segment,
    /// Soft tissue under the sensor, in the turning segment frame, on the grid.
    Tissue,
    /// Mount, axes, coupling and low-pass, on the grid.
    Sensor,
    /// The gyroscope's delay, the device's clock, and the vibration in closed form: from the grid to
    /// the stamps.
    Timing,
    /// Scale, misalignment, bias and drift of each reading.
    Linear,
    /// Noise, saturation, quantisation and units.
    Digital,
}

/// Whose an effect is, where a device is recorded several times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The device's and its mount's: the same in all of its recordings.
    Device,
    /// A session's: its clock, its biases, its reference, what happens in it.
    Session,
}

/// Form of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One number.
    Scalar,
    /// Three numbers.
    Vector3,
    /// Nine numbers, row after row.
    Matrix3,
    /// An absolute time, s; written with nine decimals.
    Time,
    /// One of these words; the value is its number.
    Choice(&'static [&'static str]),
}

impl Shape {
    /// Number of values that a parameter of this form takes.
    pub const fn count(self) -> usize {
        match self {
            Self::Scalar | Self::Time | Self::Choice(_) => 1,
            Self::Vector3 => 3,
            Self::Matrix3 => 9,
        }
    }
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Name in files.
    pub name: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Form.
    pub shape: Shape,
    /// Values that change nothing (for a choice: its number).
    pub neutral: &'static [f64],
    /// Whether files may leave it out, and do so where it is neutral.
    pub is_optional: bool,
    /// Least value of each entry.
    pub lower: f64,
    /// Greatest value of each entry.
    pub upper: f64,
    /// How a fit moves each entry; none for what no fit moves.
    pub fit: Option<ParameterFit>,
}

/// How a fit moves the entries of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterFit {
    /// Step of finite differences.
    pub step: f64,
    /// Standard deviation of the weak prior around the value so far: as large as such things get.
    pub prior_deviation: f64,
}

/// One effect: name, parameters, and what a report says about it.
#[derive(Clone, Copy, Debug)]
pub struct EffectSpec {
    /// The effect's entry in [`EffectKind`].
    pub kind: EffectKind,
    /// Name in files.
    pub name: &'static str,
    /// Where it acts.
    pub stage: Stage,
    /// Whether it stays the same from one recording of a device to the next.
    pub owner: Owner,
    /// What it is and what it leaves in a residual.
    pub summary: &'static str,
    /// What an engineer would do about it.
    pub remedy: &'static str,
    /// Parameters, in the order of the values.
    pub parameters: &'static [ParameterSpec],
    /// Channels that read otherwise under it, by itself.
    pub channels: &'static [Channel],
    /// How a diagnosis finds it.
    pub search: Search,
}

impl EffectSpec {
    /// Number of values of all parameters.
    pub fn value_count(&self) -> usize {
        self.parameters
            .iter()
            .map(|parameter| parameter.shape.count())
            .sum()
    }

    /// The values that change nothing.
    pub fn neutral(&self) -> Vec<f64> {
        self.parameters
            .iter()
            .flat_map(|parameter| parameter.neutral.iter().copied())
            .collect()
    }

    /// The effect with flat values, matrices row by row.
    ///
    /// # Errors
    /// [`EffectError`] for a wrong number of values, and values that are not finite or out of
    /// bounds.
    pub(super) fn effect(&self, values: Vec<f64>) -> Result<Effect, EffectError> {
        let effect = self.name;
        if values.len() != self.value_count() {
            return Err(EffectError::Length {
                effect,
                expected: self.value_count(),
                found: values.len(),
            });
        }
        let mut rest = values.as_slice();
        for parameter in self.parameters {
            let (own, after) = rest.split_at(parameter.shape.count());
            rest = after;
            parameter.check(effect, own)?;
        }
        Ok(Effect::from_checked(self.kind, values))
    }
}

impl ParameterSpec {
    /// Whether its values are within the bounds, and a choice's is the number of a word.
    fn check(&self, effect: &'static str, values: &[f64]) -> Result<(), EffectError> {
        let (field, lower, upper) = (self.name, self.lower, self.upper);
        if let Some(&value) = values
            .iter()
            .find(|value| !(lower..=upper).contains(*value))
        {
            return Err(EffectError::OutOfRange {
                effect,
                field,
                value,
                lower,
                upper,
            });
        }
        if matches!(self.shape, Shape::Choice(_)) && values[0].fract() != 0.0 {
            return Err(EffectError::Malformed {
                effect,
                field: field.to_owned(),
                expected: "the number of a choice",
            });
        }
        Ok(())
    }
}
