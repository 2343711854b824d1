//! The human body: SMPL model files, shape, skeleton, skin and the sites that sensors sit on.
//!
//! A body is a triangle mesh over 24 joints (SMPL, Loper et al. 2015). Shape coefficients `betas`
//! move the rest mesh, the joints follow it, and a [`BodyPose`] turns it: `world_from_segments` is
//! the skeleton, `skin` the whole mesh (f32, fast), `subset` a few vertices (f64).
//!
//! Files of SMPL, SMPL-H and SMPL-X are read by their content, npz or pickle; SMPL-H and SMPL-X
//! keep their mesh and become bodies of 24 joints, exactly so while their fingers, jaw and eyes
//! rest ([`BodyModel::read`]).
//!
//! Frames: the model frame has x to the subject's left, y up and z forward, in T-pose; the world is
//! z up. A segment's frame stands at its joint and is parallel to the model frame at rest. Lengths
//! are metres, angles radians, and transforms read right to left.
//!
//! ```
//! use cromosim_body::{BodyModel, BodyPose, Joint, ShapedBody};
//!
//! # fn main() -> Result<(), cromosim_body::BodyError> {
//! let model = BodyModel::embedded();
//! let tall = ShapedBody::new(model.clone(), &[1.0])?;
//! let standing = BodyPose::rest(nalgebra::Vector3::new(0.0, 0.0, 1.0));
//! let world_from_left_wrist = tall.world_from_segments(&standing)[Joint::LeftWrist.index()];
//! let watch = model.site("left_watch")?;
//! let skin_under_the_watch = tall.subset(&model.triangle(&watch)?)?.positions(&standing);
//! # assert!((world_from_left_wrist.translation.vector - skin_under_the_watch[0]).norm() < 0.1);
//! # Ok(())
//! # }
//! ```

mod betas;
mod embedded;
mod error;
mod file;
mod gender;
mod joint;
pub mod lanes;
mod model;
mod pose;
mod pose_blocks;
mod pose_corrections;
mod posedirs;
mod raw;
mod read;
mod reduce;
mod rows;
mod shape;
mod shape_fit;
mod shape_space;
mod site;
mod site_lookup;
mod skin;
mod skin_tables;
mod subset;
mod transfer;
mod write;

pub use error::BodyError;
pub use gender::Gender;
pub use joint::{JOINT_COUNT, Joint};
pub use model::BodyModel;
pub use pose::BodyPose;
pub use shape::ShapedBody;
pub use shape_fit::ShapeFit;
pub use shape_space::ShapeSpace;
pub use site::Site;
pub use subset::{PosesInLanes, VertexSubset, VisitPoses};
pub use write::write_obj;
