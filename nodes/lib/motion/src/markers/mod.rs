//! Optical markers: recordings of them, and the body that moved under them.

mod clip;

pub use clip::MarkerClip;
pub(crate) use clip::{checked_rate, unit_scale};
