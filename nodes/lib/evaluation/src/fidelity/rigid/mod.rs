//! Poses of rigid bodies against readings that no scheme of ours made: a physics engine's, derivatives
//! of closed forms, and real IMUs' beside their optical reference. The practice is compared: one low-pass, then differences.

mod alignment;
mod analytic;
mod case;
mod definition;
mod method;
mod picture;
mod pose_errors;
mod results;
mod stated;
mod study;
mod tables;
mod truth;

pub use definition::{AnalyticSource, PhysicsSource, RigidPicture, RigidStudy};
pub use picture::{PictureResults, SeenResults};
pub use pose_errors::PoseErrors;
pub use results::{
    PracticeResults, RigidMethodResults, RigidPartResults, RigidStudyResults, StatedResults,
};
pub(super) use study::{RigidOutcome, check_recordings, run_rigid_study};
pub(super) use tables::{pictures, rigid_charts, rigid_markdown, rigid_sections};
