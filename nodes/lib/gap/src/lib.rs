//! The gap between simulated and real IMUs: where it lies, which effect causes it, how far it
//! shrinks once that effect is added. README.md says how a diagnosis works, file by file.

mod analysis;
mod attenuation;
mod axes;
mod axes_choice;
mod beside_response;
mod builder;
mod calibration;
mod channel_lags;
mod clock_jumps;
mod clock_runs;
mod coarse_alignment;
mod confounding;
mod correlation;
mod dependence_curves;
mod diagnose;
mod diagnosis;
mod digital;
mod error;
mod evidence;
mod exchanged_axes;
mod fill;
mod findings;
mod fit;
mod force_slopes;
mod gauss_newton;
mod gram;
mod identify;
mod joint_search;
mod kept_motion;
mod lag;
mod lever_arm_by_readings;
mod library;
mod location;
mod magnetometer;
mod metrics;
mod mistaken_noise;
pub mod monitor;
mod noise_model;
mod noise_updates;
mod parts_of_time;
mod period;
mod plausibility;
mod policy;
mod prepared;
mod probability;
mod progress;
mod record;
mod reference_jumps;
mod reference_tracks;
pub mod report;
mod reportable;
mod residual_regressions;
mod resolved_noise;
mod response;
mod same_motion;
mod screen;
mod search;
mod sensor_noise;
mod session;
mod shares;
mod simulations;
mod smoothing;
mod standard_errors;
mod thinned;
mod together;
mod trace;
mod turns;
mod unexplained;
mod unknown;
mod variance_split;
mod whiten;
mod words;

pub use dependence_curves::DependenceCurve;
pub use diagnose::{DiagnoseOptions, OfRecording, PlacementAnswer, diagnose, diagnose_together};
pub use diagnosis::{
    Cause, ClockJump, Diagnosis, Gap, GapLocation, Interval, KeptCalibration, MagneticCause,
    MagneticGap, MagnetometerDiagnosis, Metrics, PlacementDiagnosis, RecordingCause,
    RecordingDiagnosis, ReferenceResponse, SCHEMA, Unexplained, Unidentifiable,
};
pub use error::GapError;
pub use evidence::{CoursePoint, Evidence, MagneticCurves, Spectra};
pub use progress::Progress;
pub use record::{MeasuredField, MeasuredImu, PlacementRecord, PoseSeries};
