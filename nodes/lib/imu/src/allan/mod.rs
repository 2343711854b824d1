//! Allan deviation of an IMU at rest, and the noise of a device by it.
//!
//! Readings r at rest, averaged over tau, `y_k`, have the Allan variance `<(y_(k+1) - y_k)^2> / 2`
//! (IEEE Std 952, annex C). What a device file states shows in it as
//! ```text
//! white noise N, (m/s2)/sqrt(Hz)                        N^2 / tau
//! bias instability s, T (first-order Gauss-Markov)      2 s^2 T / tau (1 - T / (2 tau) (3 - 4 exp(-tau / T) + exp(-2 tau / T)))
//! bias walk K, (m/s3)/sqrt(Hz)                          K^2 tau / 3
//! ```
//! with N as the two-sided density that a data sheet prints and [`crate::DeclaredNoise`] holds: noise
//! per sample is `N sqrt(rate)`. [`allan_curve`] is the overlapping estimate with its interval,
//! [`NoiseModel::fit`] what of these the curve shows, [`StaticNoise`] both for a recording at rest, as
//! effects of a device.

mod chi_squared;
mod curve;
mod model;
mod recording;

pub use curve::{AllanPoint, allan_curve};
pub use model::{NoiseFit, NoiseModel};
pub use recording::{ChannelNoise, MOST_MOTION, StaticNoise};

#[cfg(test)]
mod tests;
