//! The HIERARCHY section.

use nalgebra::Vector3;

use super::clip::{BvhJoint, Channel, MAX_JOINTS};
use crate::MotionError;
use crate::text::{Cursor, Token};

/// An open brace: a joint or the end site of one.
enum Level {
    Joint(usize),
    Tip,
}

/// From HIERARCHY up to and with MOTION.
pub(super) fn parse_hierarchy(cursor: &mut Cursor<'_>) -> Result<Vec<BvhJoint>, MotionError> {
    cursor.expect("HIERARCHY")?;
    let mut joints = Vec::new();
    let mut levels = Vec::new();
    loop {
        let word = cursor.next_word();
        let keyword = word
            .map(|token| token.text.to_ascii_uppercase())
            .unwrap_or_default();
        match (keyword.as_str(), levels.last()) {
            ("ROOT", None) => open_joint(cursor, &mut joints, &mut levels, None)?,
            ("JOINT", Some(&Level::Joint(parent))) => {
                open_joint(cursor, &mut joints, &mut levels, Some(parent))?
            }
            ("END", Some(&Level::Joint(parent))) => {
                open_tip(cursor, &mut joints, &mut levels, parent)?
            }
            ("CHANNELS", Some(&Level::Joint(joint))) if joints[joint].channels.is_empty() => {
                joints[joint].channels = parse_channels(cursor)?;
            }
            ("}", Some(_)) => drop(levels.pop()),
            ("MOTION", None) if !joints.is_empty() => return Ok(joints),
            (_, None) if joints.is_empty() => return Err(cursor.unexpected("ROOT", word)),
            (_, None) => return Err(cursor.unexpected("MOTION or ROOT", word)),
            (_, Some(Level::Joint(_))) => {
                return Err(cursor.unexpected("JOINT, End Site, CHANNELS or }", word));
            }
            (_, Some(Level::Tip)) => return Err(cursor.unexpected("}", word)),
        }
    }
}

fn open_joint(
    cursor: &mut Cursor<'_>,
    joints: &mut Vec<BvhJoint>,
    levels: &mut Vec<Level>,
    parent: Option<usize>,
) -> Result<(), MotionError> {
    let name = cursor.rest_of_line();
    if name.text.is_empty() {
        let found = cursor.next_word();
        return Err(cursor.unexpected(
            "the joint's name",
            found.or(Some(Token {
                text: "",
                line: name.line,
            })),
        ));
    }
    if joints.len() >= MAX_JOINTS {
        return Err(MotionError::Limit {
            name: cursor.name().to_owned(),
            line: name.line,
            what: "joints",
            limit: MAX_JOINTS,
        });
    }
    let name = name.text.to_owned();
    let rest_in_parent = open_level(cursor)?;
    levels.push(Level::Joint(joints.len()));
    joints.push(BvhJoint {
        name,
        parent,
        rest_in_parent,
        channels: Vec::new(),
        tip: None,
    });
    Ok(())
}

fn open_tip(
    cursor: &mut Cursor<'_>,
    joints: &mut [BvhJoint],
    levels: &mut Vec<Level>,
    parent: usize,
) -> Result<(), MotionError> {
    cursor.expect("Site")?;
    cursor.rest_of_line(); // some tools name their end sites
    let tip = open_level(cursor)?;
    levels.push(Level::Tip);
    joints[parent].tip.get_or_insert(tip);
    Ok(())
}

/// `{ OFFSET x y z`
fn open_level(cursor: &mut Cursor<'_>) -> Result<Vector3<f64>, MotionError> {
    cursor.expect("{")?;
    cursor.expect("OFFSET")?;
    let mut position = Vector3::zeros();
    for (axis, coordinate) in position.iter_mut().enumerate() {
        *coordinate = cursor.number("a number of OFFSET", axis + 1)?;
    }
    Ok(position)
}

/// `6 Xposition … Zrotation`, after the keyword.
fn parse_channels(cursor: &mut Cursor<'_>) -> Result<Vec<Channel>, MotionError> {
    let count_word = cursor.next_word();
    let count = count_word
        .and_then(|word| word.text.parse::<usize>().ok())
        .filter(|&count| count <= 6);
    let Some(count) = count else {
        return Err(cursor.unexpected("a number of channels from 0 to 6", count_word));
    };
    let mut channels = Vec::with_capacity(count);
    for _ in 0..count {
        let word = cursor.next_word();
        match word.and_then(|token| channel(token.text)) {
            Some(channel) if !channels.contains(&channel) => channels.push(channel),
            _ => {
                return Err(cursor.unexpected("a channel, each once (Xposition … Zrotation)", word));
            }
        }
    }
    Ok(channels)
}

fn channel(word: &str) -> Option<Channel> {
    let word = word.to_ascii_lowercase();
    let axis = "xyz".find(word.chars().next()?)?;
    match &word[1..] {
        "position" => Some(Channel::Position(axis)),
        "rotation" => Some(Channel::Rotation(axis)),
        _ => None,
    }
}
