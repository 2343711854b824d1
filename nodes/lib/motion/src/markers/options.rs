//! Settings of a fit.

use crate::axes::UpAxis;

/// How to fit a body to markers; every field has a default.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerOptions {
    /// The subject whose markers are taken; needed where the labels name several.
    pub subject: Option<String>,
    /// The recording's up axis.
    pub up_axis: UpAxis,
    /// Metres per unit of the file; as the file says where absent.
    pub unit_scale_m: Option<f64>,
    /// Fits where each marker is stuck, about a centimetre around where the set has it; else the set is
    /// taken as it is.
    pub fit_placement: bool,
    /// The largest number of shape coefficients that are fitted.
    pub betas: usize,
}

impl Default for MarkerOptions {
    fn default() -> Self {
        Self {
            subject: None,
            up_axis: UpAxis::Detect,
            unit_scale_m: None,
            fit_placement: true,
            betas: 10,
        }
    }
}
