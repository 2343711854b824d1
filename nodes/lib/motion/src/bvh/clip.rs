//! A clip: a skeleton, and channel values of every frame. The joint kinematics stand in
//! `kinematics.rs`.

use nalgebra::Vector3;

/// The largest number of joints that is read.
pub const MAX_JOINTS: usize = 2048;

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
    name: String,
    pub(super) joints: Vec<BvhJoint>,
    frame_time_s: f64,
    /// Frame-major, `channel_count` numbers a frame.
    values: Vec<f64>,
    channel_count: usize,
}

impl BvhClip {
    /// A clip whatever file it comes from. `values` are frame-major, the joints' channels in order;
    /// there is at least one joint with channels and one whole frame.
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

    /// The file's name.
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
