//! AMC (Acclaim motion capture): the degrees of freedom of an ASF skeleton, frame by frame.

use nalgebra::{UnitQuaternion, Vector3};

use crate::asf::turned;
use crate::bvh::cursor::{Cursor, Token};
use crate::markers::checked_rate;
use crate::{AsfChannel, AsfSkeleton, BvhClip, BvhJoint, Channel, MotionError};

/// Frames per second of an AMC file whose rate nobody gives: the file does not say, and most of the
/// CMU database has 120 Hz.
pub const AMC_RATE_HZ: f64 = 120.0;

/// Parses the text of an AMC file that moves `skeleton`, into the same form as a BVH file: so it is
/// retargeted by the same code. `rate_hz` is the recording's ([`AMC_RATE_HZ`] where unknown);
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
    let cursor = Cursor::new(text.strip_prefix('\u{feff}').unwrap_or(text), name);
    let mut parser = Parser {
        cursor,
        skeleton,
        degrees: skeleton.degrees,
    };
    let values = parser.frames()?;
    let joints = joints(skeleton);
    let channel_count = joints.iter().map(|joint| joint.channels.len()).sum();
    Ok(BvhClip {
        name: name.to_owned(),
        joints,
        frame_time_s: 1.0 / rate_hz,
        values,
        channel_count,
    })
}

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
        let skeleton = self.skeleton;
        let mut root = None;
        let mut turns: Vec<Option<UnitQuaternion<f64>>> = vec![None; skeleton.bones.len()];
        let next = loop {
            let Some(line) = self.content_line() else {
                break None;
            };
            let mut words = line.text.split_whitespace();
            let bone = words.next().unwrap_or_default();
            if bone.parse::<u64>().is_ok() && words.clone().next().is_none() {
                break Some(line);
            }
            let repeated = |parser: &Self| {
                parser.cursor.unexpected(
                    "a bone once in a frame",
                    Some(Token {
                        text: bone,
                        line: line.line,
                    }),
                )
            };
            if bone.eq_ignore_ascii_case("root") {
                if root.replace(self.root(words, line)?).is_some() {
                    return Err(repeated(self));
                }
                continue;
            }
            let Some(index) = skeleton.bone(bone) else {
                return Err(self.cursor.unexpected(
                    &format!("a bone of {}", skeleton.name),
                    Some(Token {
                        text: bone,
                        line: line.line,
                    }),
                ));
            };
            let freedoms = &skeleton.bones[index].freedoms;
            let angles = self.angles(words, freedoms.len(), line)?;
            let c = skeleton.bones[index].skeleton_from_bone;
            let turn = c * turned(freedoms.iter().copied().zip(angles)) * c.inverse();
            if turns[index].replace(turn).is_some() {
                return Err(repeated(self));
            }
        };
        let Some((position, turn)) = root else {
            return Err(self
                .cursor
                .unexpected("a line of root in every frame", Some(start)));
        };
        values.extend(position.iter());
        values.extend(zyx_degrees(&turn));
        for (bone, turn) in skeleton
            .bones
            .iter()
            .zip(&turns)
            .filter(|(bone, _)| !bone.freedoms.is_empty())
        {
            let Some(turn) = turn else {
                return Err(self.cursor.unexpected(
                    &format!("a line of {} in every frame", bone.name),
                    Some(start),
                ));
            };
            values.extend(zyx_degrees(turn));
        }
        Ok(next)
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
