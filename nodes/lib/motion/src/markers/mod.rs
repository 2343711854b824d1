//! Optical markers: recordings of them, and the body that moved under them.

mod bind;
mod clip;
mod fit;
mod frame;
mod keyframes;
mod options;
mod prior;
mod ray;
mod report;
mod set;
mod shape;
mod skin;
mod skin_weights;
mod start;
mod track;

pub use clip::MarkerClip;
pub(crate) use clip::{checked_rate, unit_scale};
pub use fit::{fit_markers, place_markers};
pub use options::MarkerOptions;
pub use report::{MarkerFit, MarkerReport};
pub use set::{MarkerSet, MarkerSite, SetMarker};
pub use start::fit_rigid;
