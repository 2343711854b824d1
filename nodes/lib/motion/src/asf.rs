//! ASF (Acclaim skeleton file): bones with lengths, directions, axes and degrees of freedom.
//!
//! A bone begins where its parent ends and goes `direction * length` further, in the skeleton's
//! axes at rest. `axis` gives the bone's own axes C at rest by three angles about fixed axes, the
//! first named first; the degrees of freedom in an AMC file turn about C's axes.

use nalgebra::{UnitQuaternion, Vector3};

use crate::bvh::cursor::{Cursor, Token};
use crate::{MAX_JOINTS, MotionError};

/// One number of a bone or of the root in a frame of an AMC file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AsfChannel {
    /// `TX`, `TY`, `TZ` of the root: position along axis 0, 1, 2, file units.
    Translation(usize),
    /// `RX`, `RY`, `RZ`: turn about axis 0, 1, 2 of the bone's axes.
    Rotation(usize),
}

/// One bone; it begins where its parent ends.
#[derive(Clone, Debug, PartialEq)]
pub struct AsfBone {
    /// As in the file.
    pub name: String,
    /// Index of the parent, always smaller than the bone's own; `None` for bones that begin at the
    /// root.
    pub parent: Option<usize>,
    /// From the bone's beginning to its end at rest, skeleton axes, file units.
    pub rest_span: Vector3<f64>,
    /// C: skeleton_from_bone at rest.
    pub skeleton_from_bone: UnitQuaternion<f64>,
    /// The axes (0 x, 1 y, 2 z) that the bone turns about, in the order of an AMC line's numbers.
    pub freedoms: Vec<usize>,
    /// Smallest and largest angle of each freedom, rad, where the file has them all; they are not
    /// enforced.
    pub limits: Vec<[f64; 2]>,
}

/// A parsed ASF file.
#[derive(Clone, Debug, PartialEq)]
pub struct AsfSkeleton {
    /// The name given to [`parse_asf`].
    pub name: String,
    /// `length` of `:units`: CMU's files have 0.45, their unit is an inch divided by it.
    pub length_unit: f64,
    /// Whether angles of the skeleton are degrees (else radians).
    pub degrees: bool,
    /// What the root's numbers in an AMC file are.
    pub root_order: Vec<AsfChannel>,
    /// Root at rest, file units.
    pub root_position: Vector3<f64>,
    /// Root at rest: the axes that the root's turns are about.
    pub root_orientation: UnitQuaternion<f64>,
    /// Parents before children.
    pub bones: Vec<AsfBone>,
}

impl AsfSkeleton {
    /// The bone called `name` (as written, in any case).
    pub fn bone(&self, name: &str) -> Option<usize> {
        self.bones
            .iter()
            .position(|bone| bone.name.eq_ignore_ascii_case(name))
    }
}

/// The rotation of three angles (rad) about fixed axes, the first one first: R = R_last R_middle
/// R_first.
pub(crate) fn turned(angles: impl IntoIterator<Item = (usize, f64)>) -> UnitQuaternion<f64> {
    angles
        .into_iter()
        .fold(UnitQuaternion::identity(), |before, (axis, angle)| {
            UnitQuaternion::from_axis_angle(
                &[Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()][axis.min(2)],
                angle,
            ) * before
        })
}

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

/// What a bone of `:bonedata` says; turned into an [`AsfBone`] once the hierarchy is known.
struct RawBone {
    name: String,
    direction: Vector3<f64>,
    length: f64,
    skeleton_from_bone: UnitQuaternion<f64>,
    freedoms: Vec<usize>,
    limits: Vec<[f64; 2]>,
    line: usize,
}

struct Parser<'a> {
    cursor: Cursor<'a>,
    skeleton: AsfSkeleton,
    raw: Vec<RawBone>,
    /// Child's name, parent's name (`None` for the root), line.
    edges: Vec<(&'a str, Option<&'a str>, usize)>,
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
    let cursor = Cursor::new(text.strip_prefix('\u{feff}').unwrap_or(text), name);
    let mut parser = Parser {
        cursor,
        skeleton,
        raw: Vec::new(),
        edges: Vec::new(),
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
            ":bonedata" => parser.bones()?,
            ":hierarchy" => parser.hierarchy()?,
            _ => parser.skip_section(),
        };
    }
    parser.finish()
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

    fn bones(&mut self) -> Result<Option<Line<'a>>, MotionError> {
        loop {
            let Some(line) = self.next_line() else {
                return Ok(None);
            };
            match line.keyword().as_str() {
                "begin" if self.raw.len() < MAX_JOINTS => {
                    let bone = self.bone(line.number)?;
                    self.raw.push(bone);
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
        let (mut name, mut direction, mut length, mut axis) =
            (None, None, None, UnitQuaternion::identity());
        let (mut freedoms, mut limits) = (Vec::new(), Vec::new());
        let mut in_limits = false;
        loop {
            let Some(line) = self.next_line() else {
                return Err(self.unexpected("end of the bone", None));
            };
            let keyword = line.keyword();
            let continues = in_limits && keyword.parse::<f64>().is_ok();
            in_limits = continues || keyword == "limits";
            match keyword.as_str() {
                "name" if line.words.len() > 1 => name = Some(line.words[1..].join(" ")),
                "direction" => {
                    direction = Some(Vector3::from(
                        self.numbers::<3>(&line, "three numbers of direction")?,
                    ))
                }
                "length" => length = Some(self.numbers::<1>(&line, "a number of length")?[0]),
                "axis" => {
                    let angles = self.numbers::<3>(&line, "three numbers and an order of axis")?;
                    axis = turned(
                        self.axis_order(line.words.get(4), &line)?
                            .into_iter()
                            .zip(angles.map(|angle| self.angle(angle))),
                    );
                }
                "dof" => freedoms = self.freedoms(&line)?,
                "limits" => limits.extend(self.limit(&line.words[1..], &line)?),
                _ if continues => limits.extend(self.limit(&line.words, &line)?),
                "id" | "bodymass" | "cofmass" => {}
                "end" => break,
                _ => {
                    return Err(self.unexpected(
                        "name, direction, length, axis, dof, limits or end",
                        Some(&line),
                    ));
                }
            }
        }
        let missing = |what: &str| {
            self.cursor.unexpected(
                what,
                Some(Token {
                    text: "a bone without it",
                    line: begin,
                }),
            )
        };
        let bone = RawBone {
            name: name.ok_or_else(|| missing("a bone's name"))?,
            direction: direction.ok_or_else(|| missing("a bone's direction"))?,
            length: length.ok_or_else(|| missing("a bone's length"))?,
            skeleton_from_bone: axis,
            limits: if limits.len() == freedoms.len() {
                limits
            } else {
                Vec::new()
            },
            freedoms,
            line: begin,
        };
        Ok(bone)
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
                    self.edges.extend(
                        line.words[1..]
                            .iter()
                            .map(|&child| (child, parent, line.number)),
                    );
                    if self.edges.len() > MAX_JOINTS {
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

    /// Brings the bones into an order with parents first. Each bone must hang on the root, once.
    fn finish(mut self) -> Result<AsfSkeleton, MotionError> {
        let index_of = |name: &str| {
            self.raw
                .iter()
                .position(|bone| bone.name.eq_ignore_ascii_case(name))
        };
        let mut parents: Vec<Option<Option<usize>>> = vec![None; self.raw.len()];
        for &(child, parent, line) in &self.edges {
            let known = |name: &'a str| {
                index_of(name).ok_or_else(|| {
                    self.cursor
                        .unexpected("a bone of :bonedata", Some(Token { text: name, line }))
                })
            };
            let (child_index, parent) = (known(child)?, parent.map(known).transpose()?);
            if parents[child_index].replace(parent).is_some() {
                return Err(self
                    .cursor
                    .unexpected("a bone with one parent", Some(Token { text: child, line })));
            }
        }
        let mut placed: Vec<Option<usize>> = vec![None; self.raw.len()];
        let mut order = Vec::with_capacity(self.raw.len());
        // Breadth first: level by level, so that a ring of bones ends the loop rather than keeping
        // it.
        loop {
            let ready = |bone: &usize| match parents[*bone] {
                Some(None) => placed[*bone].is_none(),
                Some(Some(parent)) => placed[*bone].is_none() && placed[parent].is_some(),
                None => false,
            };
            let level: Vec<usize> = (0..self.raw.len()).filter(ready).collect();
            if level.is_empty() {
                break;
            }
            for bone in level {
                placed[bone] = Some(order.len());
                order.push(bone);
            }
        }
        if let Some(loose) = (0..self.raw.len()).find(|&bone| placed[bone].is_none()) {
            let bone = &self.raw[loose];
            return Err(self.cursor.unexpected(
                "a bone that hangs on the root",
                Some(Token {
                    text: &bone.name,
                    line: bone.line,
                }),
            ));
        }
        if order.is_empty() {
            return Err(self.unexpected(":bonedata and :hierarchy with bones", None));
        }
        let bone = |&index: &usize| {
            let raw = &self.raw[index];
            AsfBone {
                name: raw.name.clone(),
                parent: parents[index].flatten().and_then(|parent| placed[parent]),
                rest_span: raw.direction.try_normalize(1e-12).unwrap_or_default() * raw.length,
                skeleton_from_bone: raw.skeleton_from_bone,
                freedoms: raw.freedoms.clone(),
                limits: raw.limits.clone(),
            }
        };
        self.skeleton.bones = order.iter().map(bone).collect();
        Ok(self.skeleton)
    }
}
