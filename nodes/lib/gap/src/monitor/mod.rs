//! A quick look at the gap, again and again on a sliding window: how large it is, and which one
//! effect would explain most of it. [`assess`] says how.
//!
//! This is no diagnosis: one effect at a time, no held-out data, no probabilities. It says where to
//! look while a device is worn.

mod assessment;
mod candidates;
mod columns;
#[cfg(test)]
mod columns_tests;
mod lag;
mod pairs;
mod reading;
mod scene;
#[cfg(test)]
mod tests;

pub use assessment::{Assessment, FirstCause, Tried, assess};
pub use reading::{ImuReading, Pace, noise_floors, pace};
pub use scene::MonitorOptions;
