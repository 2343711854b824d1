//! What a diagnosis shows: the curves of each placement, and where they stand.

use cromosim_spatial::Stamp;
use re_sdk::EntityPath;

/// Paths of the six axes below a placement, and the unit of each.
pub(crate) const GAP_AXES: [(&str, &str); 6] = [
    ("accel_x", "m/s²"),
    ("accel_y", "m/s²"),
    ("accel_z", "m/s²"),
    ("gyro_x", "rad/s"),
    ("gyro_y", "rad/s"),
    ("gyro_z", "rad/s"),
];
/// One placement's curves. All lists by stamp have the same length.
#[derive(Clone, Debug, Default)]
pub struct GapPlacement {
    /// Its name.
    pub name: String,
    /// Verdict and causes, as Markdown.
    pub words: String,
    /// Of each reading.
    pub stamps: Vec<Stamp>,
    /// Accelerometer [m/s²], gyroscope [rad/s], as recorded.
    pub measured: Vec<[f64; 6]>,
    /// The nominal simulation.
    pub before: Vec<[f64; 6]>,
    /// With all named causes.
    pub after: Vec<[f64; 6]>,
    /// Whitened residual over time.
    pub course: Vec<GapCoursePoint>,
    /// Spectra of one axis of each channel.
    pub spectra: Vec<GapSpectrum>,
}

/// Mean square of the whitened residual around a time; 1 is noise alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct GapCoursePoint {
    /// Since the placement's first stamp, s.
    pub seconds: f64,
    /// Accelerometer before and after.
    pub accel: [f64; 2],
    /// Gyroscope before and after.
    pub gyro: [f64; 2],
}

/// One-sided densities on common frequencies.
#[derive(Clone, Debug, Default)]
pub struct GapSpectrum {
    /// What is shown, with its unit.
    pub title: String,
    /// Hz.
    pub frequencies: Vec<f64>,
    /// Lines on these frequencies: name and density. `measured`, `before`, `after` and `predicted`
    /// have the colours of the curves.
    pub lines: Vec<(String, Vec<f64>)>,
}

/// The path of something of a placement; the name is one part of it, whatever characters it has.
pub(crate) fn gap_path(placement: &str, parts: &[&str]) -> EntityPath {
    let parts = ["gap", placement].into_iter().chain(parts.iter().copied());
    EntityPath::new(parts.map(Into::into).collect())
}
