//! BVH (Biovision hierarchy): a skeleton, and channel values of every frame.
//!
//! There is no standard; what is read follows what tools write. A joint's rotation is the product
//! of its rotation channels in their order, `Rz Rx Ry` for `Zrotation Xrotation Yrotation`, in
//! degrees; position channels take the place of the joint's rest position.
//!
//! The crate bvh_anim (0.4.0, the newest) is not used: it keeps values as f32 and panics on a
//! malformed hierarchy.

mod clip;
mod frames;
mod hierarchy;
mod kinematics;
mod parse;
mod write;

pub use clip::{BvhClip, BvhJoint, Channel, MAX_JOINTS};
pub use kinematics::SkeletonPose;
pub use parse::parse_bvh;
pub use write::write_bvh;
pub(crate) use write::zxy_degrees;
