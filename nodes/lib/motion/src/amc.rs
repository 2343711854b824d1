//! AMC (Acclaim motion capture): the degrees of freedom of an ASF skeleton, frame by frame. No
//! crate was found that reads it.

use nalgebra::{UnitQuaternion, Vector3};

use crate::asf::turned;
use crate::markers::checked_rate;
use crate::text::{Cursor, Token, without_byte_order_mark};
use crate::{AsfChannel, AsfSkeleton, BvhClip, BvhJoint, Channel, MotionError};

/// Frames per second of an AMC file whose rate is not given, Hz: the file does not say, and most of
/// the CMU database has 120 Hz.
pub const AMC_RATE_HZ: f64 = 120.0;

/// Parses the text of an AMC file that moves `skeleton` into the same form as a BVH file, so that
/// the same code retargets it. `rate_hz` is the recording's ([`AMC_RATE_HZ`] where unknown);
/// `name` stands in the errors. No file is touched.
///
/// With M the turn by a bone's numbers (about fixed axes, the first number first) and C its axes at
/// rest, the bone turns by `parent_from_joint = C M C^-1`: every frame is parallel to the
/// skeleton's axes at rest, as in a BVH file. The joints are `root` and one for each bone, under
/// the bone's name, where the bone begins; its tip is where the bone ends.
///
/// # Errors
/// [`MotionError::Syntax`], [`MotionError::Value`], [`MotionError::ChannelCount`], each with the
/// line; [`MotionError::Setting`] for an absurd rate. Memory stays proportional to the text.
pub fn parse_amc(
    text: &str,
    name: &str,
    skeleton: &AsfSkeleton,
    rate_hz: f64,
) -> Result<BvhClip, MotionError> {
    let rate_hz = checked_rate(name, rate_hz)?;
    let cursor = Cursor::new(without_byte_order_mark(text), name);
    let mut parser = Parser {
        cursor,
        skeleton,
        degrees: skeleton.degrees,
    };
    let values = parser.frames()?;
    Ok(BvhClip::from_parts(
        name,
        joints(skeleton),
        1.0 / rate_hz,
        values,
    ))
}

/// The channels of a joint that turns, in the order in which [`zyx_degrees`] gives them.
const TURNS: [Channel; 3] = [
    Channel::Rotation(2),
    Channel::Rotation(1),
    Channel::Rotation(0),
];

/// The root, and a joint at the beginning of every bone.
fn joints(skeleton: &AsfSkeleton) -> Vec<BvhJoint> {
    let positions = [0, 1, 2].map(Channel::Position);
    let root = BvhJoint {
        name: "root".to_owned(),
        parent: None,
        rest_in_parent: skeleton.root_position,
        channels: positions.into_iter().chain(TURNS).collect(),
        tip: None,
    };
    let bones = skeleton.bones.iter().map(|bone| BvhJoint {
        name: bone.name.clone(),
        parent: Some(bone.parent.map_or(0, |parent| parent + 1)),
        rest_in_parent: bone
            .parent
            .map_or_else(Vector3::zeros, |parent| skeleton.bones[parent].rest_span),
        channels: if bone.freedoms.is_empty() {
            Vec::new()
        } else {
            TURNS.to_vec()
        },
        tip: Some(bone.rest_span),
    });
    std::iter::once(root).chain(bones).collect()
}

/// What a frame says of the root and of each bone.
struct Frame {
    /// Position (file units) and rotation.
    root: Option<(Vector3<f64>, UnitQuaternion<f64>)>,
    /// parent_from_joint of each bone.
    turns: Vec<Option<UnitQuaternion<f64>>>,
}

struct Parser<'a> {
    cursor: Cursor<'a>,
    skeleton: &'a AsfSkeleton,
    degrees: bool,
}

impl<'a> Parser<'a> {
    /// All frames: root position and angles, then the angles of each bone that turns.
    fn frames(&mut self) -> Result<Vec<f64>, MotionError> {
        let mut line = self.header()?;
        let mut values = Vec::new();
        let mut expected_frame = None;
        while let Some(token) = line {
            let number = token.text.parse::<u64>().ok();
            match (number, expected_frame) {
                (Some(number), Some(expected)) if number != expected => {
                    return Err(self
                        .cursor
                        .unexpected(&format!("frame {expected}"), Some(token)));
                }
                (Some(number), _) => expected_frame = Some(number.saturating_add(1)),
                (None, _) => {
                    return Err(self.cursor.unexpected("the number of a frame", Some(token)));
                }
            }
            line = self.frame(token, &mut values)?;
        }
        if values.is_empty() {
            return Err(self.cursor.unexpected("a frame", None));
        }
        Ok(values)
    }

    /// Passes over comments and the words before the first frame.
    fn header(&mut self) -> Result<Option<Token<'a>>, MotionError> {
        loop {
            let line = self.content_line();
            match line.map(|token| token.text.to_ascii_lowercase()).as_deref() {
                Some(":degrees") => self.degrees = true,
                Some(":radians") => self.degrees = false,
                Some(word) if word.starts_with(':') => {}
                _ => return Ok(line),
            }
        }
    }

    fn content_line(&mut self) -> Option<Token<'a>> {
        loop {
            let line = self.cursor.next_line()?;
            let text = line.text.split('#').next().unwrap_or_default().trim();
            if !text.is_empty() {
                return Some(Token {
                    text,
                    line: line.line,
                });
            }
        }
    }

    /// The lines of one frame after its number; returns the line after them.
    fn frame(
        &mut self,
        start: Token<'a>,
        values: &mut Vec<f64>,
    ) -> Result<Option<Token<'a>>, MotionError> {
        let mut frame = Frame {
            root: None,
            turns: vec![None; self.skeleton.bones.len()],
        };
        let next = loop {
            let Some(line) = self.content_line() else {
                break None;
            };
            let mut words = line.text.split_whitespace();
            let bone = words.next().unwrap_or_default();
            if bone.parse::<u64>().is_ok() && words.clone().next().is_none() {
                break Some(line);
            }
            self.bone(bone, words, line, &mut frame)?;
        };
        self.write(&frame, start, values)?;
        Ok(next)
    }

    /// A line of a frame: the name of the root or of a bone, and its numbers.
    fn bone(
        &self,
        name: &str,
        numbers: std::str::SplitWhitespace<'_>,
        line: Token<'_>,
        frame: &mut Frame,
    ) -> Result<(), MotionError> {
        let unexpected = |expected: &str| {
            let found = Token {
                text: name,
                line: line.line,
            };
            self.cursor.unexpected(expected, Some(found))
        };
        let repeated = if name.eq_ignore_ascii_case("root") {
            frame.root.replace(self.root(numbers, line)?).is_some()
        } else {
            let Some(index) = self.skeleton.bone(name) else {
                return Err(unexpected(&format!("a bone of {}", self.skeleton.name)));
            };
            let bone = &self.skeleton.bones[index];
            let angles = self.angles(numbers, bone.freedoms.len(), line)?;
            let c = bone.skeleton_from_bone;
            let turn = c * turned(bone.freedoms.iter().copied().zip(angles)) * c.inverse();
            frame.turns[index].replace(turn).is_some()
        };
        if repeated {
            return Err(unexpected("a bone once in a frame"));
        }
        Ok(())
    }

    /// Adds a frame's numbers to `values`; every bone that turns must be in it.
    fn write(
        &self,
        frame: &Frame,
        start: Token<'_>,
        values: &mut Vec<f64>,
    ) -> Result<(), MotionError> {
        let missing = |name: &str| {
            let expected = format!("a line of {name} in every frame");
            self.cursor.unexpected(&expected, Some(start))
        };
        let (position, turn) = frame.root.ok_or_else(|| missing("root"))?;
        values.extend(position.iter());
        values.extend(zyx_degrees(&turn));
        for (bone, turn) in self.skeleton.bones.iter().zip(&frame.turns) {
            if !bone.freedoms.is_empty() {
                let turn = turn.as_ref().ok_or_else(|| missing(&bone.name))?;
                values.extend(zyx_degrees(turn));
            }
        }
        Ok(())
    }

    /// Position (file units) and rotation of the root.
    fn root(
        &self,
        words: std::str::SplitWhitespace<'_>,
        line: Token<'_>,
    ) -> Result<(Vector3<f64>, UnitQuaternion<f64>), MotionError> {
        let order = &self.skeleton.root_order;
        let numbers = self.numbers(words, order.len(), line)?;
        let mut position = self.skeleton.root_position;
        let mut turns = Vec::with_capacity(3);
        for (channel, number) in order.iter().zip(numbers) {
            match *channel {
                AsfChannel::Translation(axis) => position[axis] += number,
                AsfChannel::Rotation(axis) => turns.push((axis, self.radians(number))),
            }
        }
        let c = self.skeleton.root_orientation;
        Ok((position, c * turned(turns) * c.inverse()))
    }

    fn angles(
        &self,
        words: std::str::SplitWhitespace<'_>,
        count: usize,
        line: Token<'_>,
    ) -> Result<Vec<f64>, MotionError> {
        Ok(self
            .numbers(words, count, line)?
            .into_iter()
            .map(|number| self.radians(number))
            .collect())
    }

    fn radians(&self, number: f64) -> f64 {
        if self.degrees {
            number.to_radians()
        } else {
            number
        }
    }

    fn numbers(
        &self,
        words: std::str::SplitWhitespace<'_>,
        count: usize,
        line: Token<'_>,
    ) -> Result<Vec<f64>, MotionError> {
        let found = words.clone().count();
        if found != count {
            return Err(MotionError::ChannelCount {
                name: self.cursor.name().to_owned(),
                line: line.line,
                expected: count,
                found,
            });
        }
        let number = |(column, text)| {
            self.cursor.parse_number(
                Token {
                    text,
                    line: line.line,
                },
                "a number",
                column + 1,
            )
        };
        words.enumerate().map(number).collect()
    }
}

/// Angles so that the rotation is Rz Ry Rx, degrees.
fn zyx_degrees(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let (x, y, z) = rotation.euler_angles();
    [z, y, x].map(f64::to_degrees)
}
