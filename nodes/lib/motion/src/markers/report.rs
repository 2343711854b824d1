//! How a marker recording was understood: for `inspect` and the summary line.

use std::fmt;

use cromosim_body::Joint;
use serde::{Deserialize, Serialize};

/// One marker of the set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarkerFit {
    /// The set's label.
    pub label: String,
    /// Root mean square distance of the recording from the body's marker, m.
    pub rms_m: f64,
    /// Share of frames in which it was not seen, in [0, 1].
    pub missing_share: f64,
    /// How far from the set's place it was found to be stuck, m; 0 where placements are not fitted.
    pub moved_m: f64,
}

/// What the fit took, left out and achieved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarkerReport {
    /// The marker set.
    pub marker_set: String,
    /// The subjects that the labels name.
    pub subjects: Vec<String>,
    /// The recording's up axis: `+z`.
    pub up_axis: String,
    /// Metres per unit of the file.
    pub unit_scale_m: f64,
    /// The set's markers that are in the recording, worst first.
    pub markers: Vec<MarkerFit>,
    /// The set's markers that the recording does not have.
    pub absent: Vec<String>,
    /// Markers of the recording that the set does not have: not used.
    pub unknown: Vec<String>,
    /// Root mean square distance over all markers and frames, m.
    pub rms_m: f64,
    /// Share of the set's markers that were not seen, over all frames, in [0, 1].
    pub missing_share: f64,
    /// The frames that the shape was fitted to, 0-based.
    pub keyframes: Vec<usize>,
    /// Shape coefficients.
    pub betas: Vec<f64>,
    /// Standard deviation of each joint's position from the markers' errors alone (shape and
    /// placements taken as known), m.
    pub joint_sigma_m: Vec<(Joint, f64)>,
}

impl fmt::Display for MarkerReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "marker set {}, {} markers ({} absent, {} unknown left out), {:.1} % not seen, up {}, {:.5} m per unit, markers within {:.1} mm (root mean square)",
            self.marker_set,
            self.markers.len(),
            self.absent.len(),
            self.unknown.len(),
            100.0 * self.missing_share,
            self.up_axis,
            self.unit_scale_m,
            1000.0 * self.rms_m
        )?;
        match self.markers.first() {
            Some(worst) => write!(
                formatter,
                ", worst {} {:.1} mm",
                worst.label,
                1000.0 * worst.rms_m
            ),
            None => Ok(()),
        }
    }
}
