//! Pairs of a motion and what an IMU measured in it, from the files that a configuration names:
//! what trainings learn from, and what the fidelity of simulators is scored on.
//!
//! A [`DataSource`] names motions, on which people and devices are drawn ([`draw_wearers`]), or
//! recordings of real devices beside a reference ([`recorded_pieces`]).

mod clips;
mod drawn;
mod files;
mod pairs;
mod recorded;
mod source;

pub use clips::{LabelledMotion, MotionClip, read_labelled_motion};
pub use drawn::draw_wearers;
pub(crate) use files::{entries, matching_files};
pub use pairs::{split_pairs, training_pairs};
pub use recorded::recorded_pieces;
pub use source::{DataFolder, DataSource, PoseSource};
