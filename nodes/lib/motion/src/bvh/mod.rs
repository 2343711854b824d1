//! BVH (Biovision hierarchy): a skeleton, and channel values of every frame.
//!
//! There is no standard; what is read follows what tools write. A joint's rotation is the product
//! of its rotation channels in their order, `Rz Rx Ry` for `Zrotation Xrotation Yrotation`, in
//! degrees; position channels take the place of the joint's rest position.

pub(crate) mod cursor;
mod frames;
mod hierarchy;
mod kinematics;
mod write;

use nalgebra::Vector3;

pub(crate) use cursor::shortened;
pub use kinematics::SkeletonPose;
pub use write::write_bvh;

use crate::MotionError;

/// The largest number of joints that is read.
pub const MAX_JOINTS: usize = 2048;
/// The largest size of any number in a file: a million kilometres in the smallest unit, and far
/// more turns than any clip has.
pub const MAX_VALUE: f64 = 1e9;

/// One number of a frame: what it moves, along or about which axis (0 x, 1 y, 2 z).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Position in the parent's axes, file units.
    Position(usize),
    /// Angle, degrees.
    Rotation(usize),
}

/// One joint of the file's skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhJoint {
    /// As in the file, spaces and prefixes included.
    pub name: String,
    /// Index of the parent, always smaller than the joint's own; `None` for a root.
    pub parent: Option<usize>,
    /// `OFFSET`: the joint in its parent's axes at rest, file units.
    pub rest_in_parent: Vector3<f64>,
    /// The file's channels in their order.
    pub channels: Vec<Channel>,
    /// `End Site`: the tip of the bone in this joint's axes, file units.
    pub tip: Option<Vector3<f64>>,
}

/// A parsed BVH file: at least one joint and one frame, all numbers finite.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhClip {
    pub(crate) name: String,
    pub(crate) joints: Vec<BvhJoint>,
    pub(crate) frame_time_s: f64,
    /// Frame-major, `channel_count` numbers a frame.
    pub(crate) values: Vec<f64>,
    pub(crate) channel_count: usize,
}

impl BvhClip {
    /// A clip of other origin than a BVH file: `values` are frame-major, the joints' channels in
    /// order; there is at least one joint and one whole frame.
    pub fn from_parts(
        name: &str,
        joints: Vec<BvhJoint>,
        frame_time_s: f64,
        values: Vec<f64>,
    ) -> Self {
        Self {
            name: name.to_owned(),
            channel_count: joints.iter().map(|joint| joint.channels.len()).sum(),
            joints,
            frame_time_s,
            values,
        }
    }

    /// The name given to [`parse_bvh`].
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The joints, parents before children.
    pub fn joints(&self) -> &[BvhJoint] {
        &self.joints
    }

    /// Seconds from frame to frame, as in the file.
    pub fn frame_time_s(&self) -> f64 {
        self.frame_time_s
    }

    /// Frames per second, Hz. Files round the frame time (0.00833333 s, 0.033333 s): a rate within
    /// 0.05 % of a whole number is taken as it.
    pub fn rate_hz(&self) -> f64 {
        let rate_hz = 1.0 / self.frame_time_s;
        let whole = rate_hz.round();
        if whole >= 1.0 && (rate_hz / whole - 1.0).abs() < 5e-4 {
            whole
        } else {
            rate_hz
        }
    }

    /// Number of frames, at least one.
    pub fn frame_count(&self) -> usize {
        self.values.len() / self.channel_count
    }

    /// The numbers of one frame, in the file's order; empty beyond the last frame.
    pub fn frame(&self, index: usize) -> &[f64] {
        self.values
            .chunks_exact(self.channel_count)
            .nth(index)
            .unwrap_or(&[])
    }
}

/// Parses the text of a BVH file; `name` stands in the errors. No file is touched.
///
/// Read are: any order of channels, 0 to 6 a joint; CRLF, tabs, blank lines; names with spaces;
/// braces on any line; keywords in any case; scientific notation; a byte order mark; a missing
/// newline at the end; several roots.
///
/// # Errors
/// [`MotionError::Syntax`], [`MotionError::ChannelCount`], [`MotionError::FrameCount`],
/// [`MotionError::Value`] and [`MotionError::Limit`], each with the line. Memory stays proportional
/// to the text, whatever it declares.
pub fn parse_bvh(text: &str, name: &str) -> Result<BvhClip, MotionError> {
    let mut cursor = cursor::Cursor::new(text.strip_prefix('\u{feff}').unwrap_or(text), name);
    let joints = hierarchy::parse_hierarchy(&mut cursor)?;
    let channel_count = joints.iter().map(|joint| joint.channels.len()).sum();
    let (frame_time_s, values) = frames::parse_motion(&mut cursor, channel_count)?;
    Ok(BvhClip {
        name: name.to_owned(),
        joints,
        frame_time_s,
        values,
        channel_count,
    })
}
