//! Time stamps, rotations, splines and resampling: the mathematics under every other crate.
//!
//! Transforms read right to left: `world_from_sensor = world_from_segment * segment_from_sensor`.
//!
//! - [`Stamp`]: time, in whole nanoseconds.
//! - [`so3`]: exponential, logarithm, angular velocity from quaternion derivatives, sign-continuous
//!   quaternion series.
//! - [`SmoothingSpline`]: quintic B-spline through or near samples of several channels, on any
//!   increasing times, in O(N).
//! - [`PoseSpline`]: position and rotation splines together; gives velocity, acceleration, angular
//!   velocity and acceleration at any time.
//! - [`PoseEstimate`]: a motion from noisy poses, its noise learnt from them, with derivatives and
//!   their error; [`KinematicTrack`] is what it gives.
//! - [`FrameGrid`]: the frames between which poses were interpolated along straight chords.
//! - [`plausible`]: what bodies and sensors cannot do, in one table.
//! - [`derivative_weights`]: finite-difference stencils on any times; [`uniform_stamps`]: output
//!   grids.
//!
//! ```
//! use cromosim_spatial::{Smoothing, SmoothingSpline};
//!
//! # fn main() -> Result<(), cromosim_spatial::SpatialError> {
//! let seconds: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
//! let samples: Vec<[f64; 1]> = seconds.iter().map(|t| [(3.0 * t).sin()]).collect();
//! let spline = SmoothingSpline::fit(&seconds, &samples, Smoothing::Automatic)?;
//! let [_value, _first, second] = spline.evaluate(0.777);
//! assert!((second[0] + 9.0 * (3.0_f64 * 0.777).sin()).abs() < 1e-5);
//! # Ok(())
//! # }
//! ```

mod adaptive;
mod adaptive_fit;
mod banded;
mod basis;
mod beyond;
mod beyond_band;
mod chord_images;
mod chords;
mod confidence;
mod derivative;
mod derivative_risk;
mod difference;
mod end_derivatives;
mod end_noise;
mod equations;
mod error;
mod estimate;
mod estimate_error;
mod estimate_line;
mod file;
mod filled;
mod fourth_differences;
mod frame_grid;
mod gaps;
mod golden;
mod grid;
mod influence;
mod kernel;
mod kinks;
mod local_noise;
mod local_spline;
mod low_passed;
mod motion_response;
mod nearest_name;
mod noise_colour;
mod noise_floor;
mod noise_shape;
pub mod plausible;
mod pose_series;
mod pose_source;
mod pose_spectra;
mod pose_spline;
mod quaternion_length;
mod sample_grid;
mod sample_variance;
mod segments;
pub mod so3;
mod spectrum;
mod spline;
mod stamp;
mod system;
mod track;
mod weight_search;
mod wide;
mod zero_phase_smoothing;

pub use adaptive::ExpectedNoise;
pub use confidence::{
    CONFIDENCE_LENGTH_M, HALF_CONFIDENCE_STD_M, confidence_of_std, std_of_confidence,
};
pub use derivative::Derivative;
pub use difference::{MAX_STENCIL, derivative_weights};
pub use equations::LocalWeight;
pub use error::SpatialError;
pub use estimate::{PoseEstimate, PoseNoise};
pub use estimate_error::ErrorPath;
pub use estimate_line::PoseLine;
pub use file::{open_file, read_text};
pub use fourth_differences::{
    FOURTH_DIFFERENCE_GAIN, MEDIAN_OF_SQUARE, ROUNDED_MEDIAN_OF_SQUARE, fourth_difference,
    white_noise_variance,
};
pub use frame_grid::FrameGrid;
pub use golden::greatest_near;
pub use grid::{check_times, relative_seconds, uniform_stamps};
pub use influence::{Influence, SampleWeights};
pub use low_passed::LowPassed;
pub use motion_response::{MotionResponse, PoseDensities};
pub use nearest_name::{in_plain_words, meant, nearest_name};
pub use pose_series::PoseSeries;
pub use pose_source::PoseSource;
pub use pose_spline::{
    Located, Motion, MotionEstimate, NoiseStd, POSES_AT_ONCE, PoseAdaptation, PoseSmoothing,
    PoseSpline, PoseTimes, PosesInTime, position_channels, rotation_channels,
};
pub use rustfft::num_complex::Complex64;
pub use sample_variance::{Bandwidth, Jitter, SampleVariance};
pub use spectrum::{FourierPair, Spectrum, welch};
pub use spline::{Smoothing, SmoothingSpline, SplineWeight};
pub use stamp::Stamp;
pub use system::SplineSystem;
pub use track::KinematicTrack;
pub use weight_search::WeightSearch;
pub use zero_phase_smoothing::{SmoothingKernel, ZeroPhaseSmoothing};
