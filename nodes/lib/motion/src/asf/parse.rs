//! The sections of the file.

use nalgebra::{UnitQuaternion, Vector3};

use super::bones::{RawBone, RawBones};
use super::skeleton::{AsfChannel, AsfSkeleton, turned};
use crate::text::{Cursor, Token, without_byte_order_mark};
use crate::{MAX_JOINTS, MotionError};

fn axis_index(letter: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|known| *known == letter)
}

/// A line without its comment, as words, and where it stands.
struct Line<'a> {
    words: Vec<&'a str>,
    number: usize,
}

impl<'a> Line<'a> {
    fn keyword(&self) -> String {
        self.words
            .first()
            .map(|word| word.to_ascii_lowercase())
            .unwrap_or_default()
    }

    fn token(&self) -> Token<'a> {
        Token {
            text: self.words.first().copied().unwrap_or_default(),
            line: self.number,
        }
    }
}

/// The lines of a bone as far as they are read.
#[derive(Default)]
struct BoneFields {
    name: Option<String>,
    direction: Option<Vector3<f64>>,
    length: Option<f64>,
    axis: UnitQuaternion<f64>,
    freedoms: Vec<usize>,
    limits: Vec<[f64; 2]>,
}

struct Parser<'a> {
    cursor: Cursor<'a>,
    skeleton: AsfSkeleton,
    bones: RawBones<'a>,
}

/// Parses the text of an ASF file; `name` stands in the errors. No file is touched.
///
/// Read are `:units`, `:root`, `:bonedata` and `:hierarchy`; other sections (`:documentation`,
/// `:skin`) are passed over. Lines may begin with `#`; keywords are read in any case.
///
/// # Errors
/// [`MotionError::Syntax`], [`MotionError::Value`] and [`MotionError::Limit`], each with the line.
/// Memory stays proportional to the text.
pub fn parse_asf(text: &str, name: &str) -> Result<AsfSkeleton, MotionError> {
    let skeleton = AsfSkeleton {
        name: name.to_owned(),
        length_unit: 1.0,
        degrees: true,
        root_order: [0, 1, 2]
            .map(AsfChannel::Translation)
            .into_iter()
            .chain([0, 1, 2].map(AsfChannel::Rotation))
            .collect(),
        root_position: Vector3::zeros(),
        root_orientation: UnitQuaternion::identity(),
        bones: Vec::new(),
    };
    let cursor = Cursor::new(without_byte_order_mark(text), name);
    let mut parser = Parser {
        cursor,
        skeleton,
        bones: RawBones::default(),
    };
    let mut line = parser.next_line();
    if !line
        .as_ref()
        .is_some_and(|line| line.keyword().starts_with(':'))
    {
        return Err(parser.unexpected(":version or another section", line.as_ref()));
    }
    while let Some(section) = line {
        line = match section.keyword().as_str() {
            ":units" => parser.units()?,
            ":root" => parser.root()?,
            ":bonedata" => parser.bone_data()?,
            ":hierarchy" => parser.hierarchy()?,
            _ => parser.skip_section(),
        };
    }
    let bones = parser.bones.in_order(&parser.cursor)?;
    Ok(AsfSkeleton {
        bones,
        ..parser.skeleton
    })
}

impl<'a> Parser<'a> {
    fn next_line(&mut self) -> Option<Line<'a>> {
        loop {
            let token = self.cursor.next_line()?;
            let content = token.text.split('#').next().unwrap_or_default();
            // Limits stand in parentheses, with or without spaces around them.
            let words: Vec<&str> = content
                .split(|c: char| c.is_whitespace() || "(),".contains(c))
                .filter(|word| !word.is_empty())
                .collect();
            if !words.is_empty() {
                return Some(Line {
                    words,
                    number: token.line,
                });
            }
        }
    }

    fn skip_section(&mut self) -> Option<Line<'a>> {
        loop {
            let line = self.next_line()?;
            if line.keyword().starts_with(':') {
                return Some(line);
            }
        }
    }

    fn unexpected(&self, expected: &str, found: Option<&Line<'_>>) -> MotionError {
        self.cursor.unexpected(expected, found.map(Line::token))
    }

    /// The numbers after a line's keyword: `count` of them.
    fn numbers<const N: usize>(
        &self,
        line: &Line<'_>,
        what: &str,
    ) -> Result<[f64; N], MotionError> {
        let mut numbers = [0.0; N];
        for (column, number) in numbers.iter_mut().enumerate() {
            let Some(&word) = line.words.get(column + 1) else {
                return Err(self.unexpected(what, Some(line)));
            };
            *number = self.cursor.parse_number(
                Token {
                    text: word,
                    line: line.number,
                },
                what,
                column + 1,
            )?;
        }
        Ok(numbers)
    }

    fn angle(&self, value: f64) -> f64 {
        if self.skeleton.degrees {
            value.to_radians()
        } else {
            value
        }
    }

    fn units(&mut self) -> Result<Option<Line<'a>>, MotionError> {
        loop {
            let Some(line) = self.next_line() else {
                return Ok(None);
            };
            match line.keyword().as_str() {
                "length" => {
                    let [length] = self.numbers(&line, "a number of length")?;
                    if length <= 0.0 {
                        return Err(self.unexpected("a length above 0", Some(&line)));
                    }
                    self.skeleton.length_unit = length;
                }
                "angle" => match line.words.get(1).map(|word| word.to_ascii_lowercase()) {
                    Some(word) if word.starts_with("deg") => self.skeleton.degrees = true,
                    Some(word) if word.starts_with("rad") => self.skeleton.degrees = false,
                    _ => return Err(self.unexpected("angle deg or rad", Some(&line))),
                },
                keyword if keyword.starts_with(':') => return Ok(Some(line)),
                _ => {}
            }
        }
    }

    fn root(&mut self) -> Result<Option<Line<'a>>, MotionError> {
        let (mut orientation, mut axis) = ([0.0; 3], [0, 1, 2]);
        let end = loop {
            let Some(line) = self.next_line() else {
                break None;
            };
            match line.keyword().as_str() {
                "order" => self.skeleton.root_order = self.channels(&line)?,
                "axis" => axis = self.axis_order(line.words.get(1), &line)?,
                "position" => {
                    self.skeleton.root_position =
                        self.numbers(&line, "three numbers of position")?.into()
                }
                "orientation" => {
                    orientation = self.numbers(&line, "three numbers of orientation")?
                }
                keyword if keyword.starts_with(':') => break Some(line),
                _ => {
                    return Err(
                        self.unexpected("order, axis, position or orientation", Some(&line))
                    );
                }
            }
        };
        self.skeleton.root_orientation = turned(
            axis.into_iter()
                .zip(orientation.map(|angle| self.angle(angle))),
        );
        Ok(end)
    }

    fn channels(&self, line: &Line<'_>) -> Result<Vec<AsfChannel>, MotionError> {
        let mut channels = Vec::new();
        for word in &line.words[1..] {
            let lower = word.to_ascii_lowercase();
            let channel = match lower.split_at_checked(1) {
                Some(("t", axis)) => axis_index(axis).map(AsfChannel::Translation),
                Some(("r", axis)) => axis_index(axis).map(AsfChannel::Rotation),
                _ => None,
            };
            match channel {
                Some(channel) if !channels.contains(&channel) => channels.push(channel),
                _ => {
                    return Err(self.cursor.unexpected(
                        "TX TY TZ RX RY RZ, each once",
                        Some(Token {
                            text: word,
                            line: line.number,
                        }),
                    ));
                }
            }
        }
        Ok(channels)
    }

    fn axis_order(&self, word: Option<&&str>, line: &Line<'_>) -> Result<[usize; 3], MotionError> {
        let wrong = || self.unexpected("an order of axes like XYZ", Some(line));
        let letters: Vec<usize> = word
            .ok_or_else(wrong)?
            .chars()
            .filter_map(|letter| "xyz".find(letter.to_ascii_lowercase()))
            .collect();
        match letters[..] {
            [a, b, c] if a != b && b != c && a != c => Ok([a, b, c]),
            _ => Err(wrong()),
        }
    }

    fn bone_data(&mut self) -> Result<Option<Line<'a>>, MotionError> {
        loop {
            let Some(line) = self.next_line() else {
                return Ok(None);
            };
            match line.keyword().as_str() {
                "begin" if self.bones.raw.len() < MAX_JOINTS => {
                    let bone = self.bone(line.number)?;
                    self.bones.raw.push(bone);
                }
                "begin" => {
                    let name = self.cursor.name().to_owned();
                    return Err(MotionError::Limit {
                        name,
                        line: line.number,
                        what: "bones",
                        limit: MAX_JOINTS,
                    });
                }
                keyword if keyword.starts_with(':') => return Ok(Some(line)),
                _ => return Err(self.unexpected("begin of a bone", Some(&line))),
            }
        }
    }

    /// After `begin`, up to and with `end`.
    fn bone(&mut self, begin: usize) -> Result<RawBone, MotionError> {
        let mut bone = BoneFields::default();
        let mut in_limits = false;
        loop {
            let Some(line) = self.next_line() else {
                return Err(self.unexpected("end of the bone", None));
            };
            let keyword = line.keyword();
            if keyword == "end" {
                break;
            }
            let continues = in_limits && keyword.parse::<f64>().is_ok();
            in_limits = continues || keyword == "limits";
            if continues {
                bone.limits.extend(self.limit(&line.words, &line)?);
            } else {
                self.bone_field(&keyword, &line, &mut bone)?;
            }
        }
        let missing = |what: &str| {
            let found = Token {
                text: "a bone without it",
                line: begin,
            };
            self.cursor.unexpected(what, Some(found))
        };
        Ok(RawBone {
            name: bone.name.ok_or_else(|| missing("a bone's name"))?,
            direction: bone
                .direction
                .ok_or_else(|| missing("a bone's direction"))?,
            length: bone.length.ok_or_else(|| missing("a bone's length"))?,
            skeleton_from_bone: bone.axis,
            limits: if bone.limits.len() == bone.freedoms.len() {
                bone.limits
            } else {
                Vec::new()
            },
            freedoms: bone.freedoms,
            line: begin,
        })
    }

    /// A line of a bone that begins with a keyword.
    fn bone_field(
        &self,
        keyword: &str,
        line: &Line<'_>,
        bone: &mut BoneFields,
    ) -> Result<(), MotionError> {
        match keyword {
            "name" if line.words.len() > 1 => bone.name = Some(line.words[1..].join(" ")),
            "direction" => {
                let direction = self.numbers::<3>(line, "three numbers of direction")?;
                bone.direction = Some(Vector3::from(direction));
            }
            "length" => bone.length = Some(self.numbers::<1>(line, "a number of length")?[0]),
            "axis" => {
                let angles = self.numbers::<3>(line, "three numbers and an order of axis")?;
                bone.axis = turned(
                    self.axis_order(line.words.get(4), line)?
                        .into_iter()
                        .zip(angles.map(|angle| self.angle(angle))),
                );
            }
            "dof" => bone.freedoms = self.freedoms(line)?,
            "limits" => bone.limits.extend(self.limit(&line.words[1..], line)?),
            "id" | "bodymass" | "cofmass" => {}
            _ => {
                let expected = "name, direction, length, axis, dof, limits or end";
                return Err(self.unexpected(expected, Some(line)));
            }
        }
        Ok(())
    }

    fn freedoms(&self, line: &Line<'_>) -> Result<Vec<usize>, MotionError> {
        let mut freedoms = Vec::new();
        for channel in self.channels(line)? {
            match channel {
                AsfChannel::Rotation(axis) => freedoms.push(axis),
                AsfChannel::Translation(_) => {
                    return Err(self
                        .unexpected("rotations only (rx ry rz); bones do not slide", Some(line)));
                }
            }
        }
        Ok(freedoms)
    }

    /// `-160.0 20.0`; infinite ends are written `-inf` and `inf`.
    fn limit(&self, words: &[&str], line: &Line<'_>) -> Result<Option<[f64; 2]>, MotionError> {
        let number = |word: &&str| word.parse::<f64>().ok().filter(|number| !number.is_nan());
        match (
            words,
            words.first().and_then(number),
            words.last().and_then(number),
        ) {
            ([], ..) => Ok(None),
            ([_, _], Some(low), Some(high)) => Ok(Some([self.angle(low), self.angle(high)])),
            _ => Err(self.unexpected("limits (low high)", Some(line))),
        }
    }

    fn hierarchy(&mut self) -> Result<Option<Line<'a>>, MotionError> {
        loop {
            let Some(line) = self.next_line() else {
                return Ok(None);
            };
            match line.keyword().as_str() {
                "begin" | "end" => {}
                keyword if keyword.starts_with(':') => return Ok(Some(line)),
                parent => {
                    let parent = if parent == "root" {
                        None
                    } else {
                        Some(line.words[0])
                    };
                    self.bones.edges.extend(
                        line.words[1..]
                            .iter()
                            .map(|&child| (child, parent, line.number)),
                    );
                    if self.bones.edges.len() > MAX_JOINTS {
                        let name = self.cursor.name().to_owned();
                        return Err(MotionError::Limit {
                            name,
                            line: line.number,
                            what: "children",
                            limit: MAX_JOINTS,
                        });
                    }
                }
            }
        }
    }
}
