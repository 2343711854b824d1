//! What a placement's magnetometer reads beside the motion that its accelerometer and gyroscope agreed on:
//! hard iron, soft iron, axes and delay in a field that nobody knows.
//!
//! ```text
//! m(t) = S A R_SW(t - delay) B + h + noise        T
//! ```
//! R_SW has mount, axes and clock as the placement's own diagnosis found them, in the reference's world (a
//! tilt of which stays in B). Only the product of S and B shows: S has the determinant 1, and B the strength
//! with which this device measures it.

mod fit;
mod samples;
mod search;
mod starts;

pub(crate) use search::{MagneticRecording, diagnose_magnetometer};
