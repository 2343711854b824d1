//! The gap between simulated and real IMUs: where it lies, which effect causes it, how far it
//! shrinks once that effect is added.

mod answer;
mod diagnose;
mod diagnosis;
mod error;
mod evidence;
mod fill;
mod fit;
mod gram;
mod gross;
mod identify;
mod metrics;
pub mod monitor;
mod place;
mod probability;
mod probes;
mod problem;
mod record;
pub mod report;
mod screen;
mod search;
mod sensor_noise;
mod smoothing;
mod unknown;
mod whiten;

pub use diagnose::{DiagnoseOptions, PlacementAnswer, diagnose};
pub use diagnosis::{
    Cause, Diagnosis, Gap, Interval, Metrics, Place, PlacementDiagnosis, SCHEMA, Unexplained,
    Unidentifiable,
};
pub use error::GapError;
pub use evidence::{AXES, CoursePoint, Evidence, Spectra};
pub use record::{ImuSeries, PlacementRecord, PoseSeries};
