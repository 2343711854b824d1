//! Whose shapes a body has.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Whose shapes the betas of a body tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ShapeSpace {
    /// The embedded body's: stature, mass and eight more, each by itself.
    Cromosim,
    /// SMPL's and SMPL-H's: principal components.
    Smpl,
    /// SMPL-X's: 10 to 300 principal components.
    SmplX,
}

impl ShapeSpace {
    const ALL: [Self; 3] = [Self::Cromosim, Self::Smpl, Self::SmplX];

    /// The word in messages and files (AMASS' `surface_model_type`): `cromosim`, `smpl`, `smplx`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cromosim => "cromosim",
            Self::Smpl => "smpl",
            Self::SmplX => "smplx",
        }
    }

    /// The space of a word.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|space| space.name() == name)
    }
}

impl fmt::Display for ShapeSpace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Cromosim => "the embedded body",
            Self::Smpl => "SMPL",
            Self::SmplX => "SMPL-X",
        })
    }
}
