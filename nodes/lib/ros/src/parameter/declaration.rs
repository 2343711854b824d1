//! A parameter: its name, its value, and what is known about it.

use ros2_client::ParameterValue;

use super::value::{ParameterScalar, coerce, numbers, to_text, type_name};
use crate::error::{RosError, RosResult};

/// A parameter to declare: its name, default, and what is known about it.
#[derive(Clone, Debug)]
pub struct Parameter {
    pub(crate) name: String,
    pub(crate) value: ParameterValue,
    pub(crate) description: String,
    pub(crate) read_only: bool,
    pub(crate) range: Option<(f64, f64)>,
    pub(crate) untyped: bool,
    pub(crate) in_config: bool,
}

impl Parameter {
    /// A parameter with its default, which fixes the type.
    pub fn new(name: &str, default: impl ParameterScalar) -> Self {
        Self::with_value(name, default.into_value())
    }

    pub(crate) fn with_value(name: &str, value: ParameterValue) -> Self {
        let description = String::new();
        Self {
            name: name.to_owned(),
            value,
            description,
            read_only: false,
            range: None,
            untyped: false,
            in_config: false,
        }
    }

    /// With a description for `ros2 param describe`.
    #[must_use]
    pub fn about(mut self, description: &str) -> Self {
        description.clone_into(&mut self.description);
        self
    }

    /// Numbers from `least` to `most`, both included.
    #[must_use]
    pub fn range(mut self, least: f64, most: f64) -> Self {
        self.range = Some((least, most));
        self
    }

    /// Cannot change after the start.
    #[must_use]
    pub fn read_only(mut self) -> Self {
        self.read_only = true;
        self
    }

    /// The value as the parameter holds it; refuses another type, and what is out of bounds.
    pub(crate) fn check(&self, given: ParameterValue, place: &str) -> RosResult<ParameterValue> {
        let found = to_text(&given);
        let refuse = |expected: String| {
            let (place, name) = (place.to_owned(), self.name.clone());
            RosError::ParameterValue {
                place,
                name,
                expected,
                found,
            }
        };
        let value = if self.untyped {
            Some(given)
        } else {
            coerce(given, &self.value)
        };
        match (value, self.range) {
            (None, _) => Err(refuse(type_name(&self.value).to_owned())),
            (Some(value), Some((least, most)))
                if numbers(&value)
                    .iter()
                    .any(|number| !(least..=most).contains(number)) =>
            {
                Err(refuse(format!("{least} to {most}")))
            }
            (Some(value), _) => Ok(value),
        }
    }
}
