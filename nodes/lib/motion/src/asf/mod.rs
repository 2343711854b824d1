//! ASF (Acclaim skeleton file): bones with lengths, directions, axes and degrees of freedom.
//!
//! A bone begins where its parent ends and goes `direction * length` further, in the skeleton's
//! axes at rest. `axis` gives the bone's own axes C at rest by three angles about fixed axes, the
//! first named first; the degrees of freedom in an AMC file turn about C's axes.
//!
//! No crate was found that reads it.

mod bones;
mod parse;
mod skeleton;

pub use parse::parse_asf;
pub(crate) use skeleton::turned;
pub use skeleton::{AsfBone, AsfChannel, AsfSkeleton};
