//! Optical markers: recordings of them, and the body that moved under them.

mod bind;
mod clip;
mod fit;
mod frame;
mod keyframes;
mod prior;
mod ray;
mod report;
mod set;
mod shape;
mod skin;
mod start;
mod track;

pub use clip::MarkerClip;
pub(crate) use clip::{checked_rate, unit_scale};
pub use fit::{MarkerOptions, fit_markers, place_markers};
pub use report::{MarkerFit, MarkerReport};
pub use set::{MarkerPlace, MarkerSet, SetMarker};
pub use start::fit_rigid;
