//! The group of people that a body model was made from.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The group of people a body model was made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Gender {
    /// Made from women and men together.
    #[default]
    Neutral,
    /// Made from women.
    Female,
    /// Made from men.
    Male,
}

impl Gender {
    /// SMPL's word: `neutral`, `female`, `male`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Neutral => "neutral",
            Self::Female => "female",
            Self::Male => "male",
        }
    }

    /// From SMPL's word or its first letter, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "neutral" | "n" => Some(Self::Neutral),
            "female" | "f" => Some(Self::Female),
            "male" | "m" => Some(Self::Male),
            _ => None,
        }
    }
}

impl fmt::Display for Gender {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}
