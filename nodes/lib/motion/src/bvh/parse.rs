//! The parts of a file in order.

use super::clip::BvhClip;
use super::frames::parse_motion;
use super::hierarchy::parse_hierarchy;
use crate::MotionError;
use crate::text::{Cursor, without_byte_order_mark};

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
    let mut cursor = Cursor::new(without_byte_order_mark(text), name);
    let joints = parse_hierarchy(&mut cursor)?;
    let channel_count = joints.iter().map(|joint| joint.channels.len()).sum();
    let (frame_time_s, values) = parse_motion(&mut cursor, channel_count)?;
    Ok(BvhClip::from_parts(name, joints, frame_time_s, values))
}
