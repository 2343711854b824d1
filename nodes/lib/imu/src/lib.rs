//! From a placement on a body to an inertial measurement unit.
//!
//! A [`Placement`] says where a sensor sits; a [`MountedSensor`] gives its frame for any
//! [`cromosim_body::BodyPose`]; a [`Scheme`] differentiates the frames, offline by [`simulate`] or
//! live by [`StreamingImu`]; a [`Device`] adds noise and further [`effects`]; [`SampleVariance`] is
//! what errors of the poses ([`PoseStd`]) leave in a sample.
//!
//! The sensor reads, in its own axes (S sensor, B site on the body, G world; R_BG turns site axes
//! into world axes),
//!
//! ```text
//! a_S = R_SB^-1 R_BG^-1 (a_G - g)      specific force, m/s2: +9.80665 along "up" at rest
//! w_S = R_SB^-1 R_BG^-1  w_G           angular velocity, rad/s
//! g   = (0, 0, -9.80665) m/s2
//! ```
//!
//! ```
//! use cromosim_body::{BodyModel, BodyPose, ShapedBody};
//! use cromosim_imu::{Device, MountedSensor, PlacementSet, Scheme, StreamingEffects, simulate, simulate_kinematics};
//! use cromosim_spatial::{Stamp, uniform_stamps};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let body = ShapedBody::new(BodyModel::embedded(), &[])?;
//! let placements = PlacementSet::demo();
//! let left_wrist = placements.get("left_wrist").ok_or("no such placement")?;
//! let mounted = MountedSensor::new(&body, left_wrist)?;
//!
//! let stamps = uniform_stamps(Stamp::from_seconds(0.0), Stamp::from_seconds(1.0), 120.0)?;
//! let poses = vec![BodyPose::rest(nalgebra::Vector3::new(0.0, 0.0, 1.0)); stamps.len()];
//! let trajectory = mounted.trajectory(&stamps, &poses)?;
//!
//! let output = uniform_stamps(stamps[0], stamps[120], left_wrist.rate_hz())?;
//! let ideal = simulate(&trajectory, Scheme::Spline, &output)?;
//! assert!((ideal[50].specific_force.norm() - 9.80665).abs() < 1e-6);
//!
//! let device = Device::embedded("consumer_mems")?;
//! let mut effects = StreamingEffects::new(&device, left_wrist.rate_hz(), 42, left_wrist.name())?;
//! let motion = simulate_kinematics(&trajectory, Scheme::Spline, &output)?;
//! let real_looking: Vec<_> = motion.iter().filter_map(|sample| effects.step(sample)).collect();
//! # assert!(real_looking.len() == ideal.len() && real_looking[0] != ideal[0]);
//! # Ok(())
//! # }
//! ```

pub mod allan;
mod channel;
mod device;
pub mod effects;
mod error;
mod kalibr;
mod low_pass_error;
mod magnetic;
mod mount;
mod noise;
mod orientation;
mod placement;
mod placement_file;
mod pose_error;
mod random;
mod rest_triangle;
mod rounding;
mod sample;
mod schemes;
mod simulate;
mod stated_errors;
mod stream;
mod stream_adaptive;
mod stream_spline;
mod texture;
mod trajectory;
mod trim;
mod uncertainty;
mod virtual_imu;

#[cfg(test)]
mod symmetry_tests;
#[cfg(test)]
mod test_motions;

pub use channel::{AXES, Channel, PerChannel, Reading};
pub use cromosim_spatial::{Bandwidth, SampleVariance};
pub use device::{Device, EMBEDDED_DEVICES};
pub use effects::{
    AXIS_ORDERS, ClippingLimit, DeclaredNoise, Dependence, DrawnBiases, Dropouts, Effect,
    EffectKind, EffectSet, EffectSpec, EffectsFile, FirstGuess, FittedSearch, GravityMode,
    GridTrace, Identifiability, Kept, Lateness, MeasurementInput, Ordinary, OtherSession, Owner,
    ParameterFit, ParameterSpec, PlacementEffects, ReadOff, ReadOffSearch, ResidualView, Rounding,
    Search, SensorModel, Shape, SpectralLine, Stage, StagedReadings, StreamingEffects,
    UnexplainedErrors, Wave, clipping_limit, lattice_spacing, length_factors,
    nearest_signed_permutation, strongest_line, unit_factors, white_noise_density,
};
pub use error::{EffectError, ImuError, PlacementProblem};
pub use kalibr::KalibrNoise;
pub use magnetic::{AmbientField, MagneticMotion, Magnetometer, measure_magnetic_recording};
pub use mount::{MountedSensor, MountedSensors, SensorPose, point_oddity};
pub use noise::{Covariances, NoiseSource};
pub use orientation::OrientationSource;
pub use placement::{Follow, MAX_RATE_HZ, Placement, SiteChoice};
pub use placement_file::PlacementSet;
pub use pose_error::PoseStd;
pub use random::normal_pair;
pub use rounding::{expected_rounding, expected_rounding_adds, rounding_difference};
pub use sample::{
    GRAVITY_IN_WORLD, ImuSample, KinematicSample, STANDARD_GRAVITY, track_in_sensor_axes,
};
pub use schemes::Scheme;
pub use simulate::{
    Differentiation, simulate, simulate_kinematics, simulate_kinematics_on, simulate_several_on,
};
pub use stated_errors::change_per_second;
pub use stream::{StreamOptions, StreamingImu};
pub use texture::{DrawnTexture, TextureSegment, add_texture};
pub use trajectory::{SensorFrame, SensorTrajectory};
pub use trim::{LONGEST_TRIM_S, Trim, median_bandwidth};
pub use virtual_imu::{
    ImuMessages, ImuOptions, Measured, MotionCorrection, ReadingMapping, RecordedMotion,
    VirtualImu, measure_all, measure_recording,
};
