//! The magnetic field of a place, and what a device's magnetometer makes of it.

mod field;
mod magnetometer;
mod recorded;

pub use field::AmbientField;
pub use magnetometer::Magnetometer;
pub(crate) use magnetometer::{MagneticSensor, RawMagnetometer};
pub use recorded::{MagneticMotion, measure_magnetic_recording};
