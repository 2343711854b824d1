//! From the text of an MVNX file to its numbers.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::Mvnx;
use crate::text::{MAX_VALUE, shortened, without_byte_order_mark};
use crate::{MAX_JOINTS, MotionError};

/// How far a quaternion's length may be from 1, as printed digits leave it.
const LENGTH_TOLERANCE: f64 = 0.01;
/// Rates that are believed, Hz.
const RATES_HZ: std::ops::RangeInclusive<f64> = 1.0..=1e4;

/// Parses the text of an MVNX file; `name` stands in the errors. No file is touched.
///
/// # Errors
/// [`MotionError::Syntax`], [`MotionError::Limit`], with the line.
pub fn parse_mvnx(text: &str, name: &str) -> Result<Mvnx, MotionError> {
    let text = without_byte_order_mark(text);
    let mut walk = Walk {
        text,
        reader: Reader::from_str(text),
        mvnx: Mvnx {
            name: name.to_owned(),
            ..Mvnx::default()
        },
        subjects: 0,
        depth: 0,
        list: String::new(),
        in_frame: false,
        field: None,
        seen: [false; FIELDS.len()],
    };
    loop {
        let event = walk.reader.read_event();
        let event = event.map_err(|error| walk.wrong("well-formed XML", &error.to_string()))?;
        match event {
            Event::Start(element) => {
                walk.depth += 1;
                walk.start(&element)?;
            }
            Event::Empty(element) => {
                walk.start(&element)?;
                walk.end(element.local_name().as_ref())?;
            }
            Event::End(element) => {
                walk.depth = walk.depth.saturating_sub(1);
                walk.end(element.local_name().as_ref())?;
            }
            Event::Text(numbers) => walk.numbers(&numbers)?,
            Event::Eof => break,
            _ => {}
        }
    }
    walk.finish()
}

/// What is read of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Field {
    Orientation,
    Position,
    AngularVelocity,
    SensorOrientation,
    SensorFreeAcceleration,
}

const FIELDS: [(&str, Field); 5] = [
    ("orientation", Field::Orientation),
    ("position", Field::Position),
    ("angularVelocity", Field::AngularVelocity),
    ("sensorOrientation", Field::SensorOrientation),
    ("sensorFreeAcceleration", Field::SensorFreeAcceleration),
];

impl Field {
    const fn is_turn(self) -> bool {
        matches!(self, Self::Orientation | Self::SensorOrientation)
    }

    const fn is_of_sensors(self) -> bool {
        matches!(self, Self::SensorOrientation | Self::SensorFreeAcceleration)
    }
}

struct Walk<'a> {
    text: &'a str,
    reader: Reader<&'a [u8]>,
    mvnx: Mvnx,
    subjects: usize,
    /// Elements that are open.
    depth: usize,
    /// The list of labels that is open: `segments` or `sensors`; those of fingers are others.
    list: String,
    /// Within a frame of type `normal`.
    in_frame: bool,
    /// Within its list of numbers.
    field: Option<usize>,
    /// Which lists the frame has.
    seen: [bool; FIELDS.len()],
}

impl Walk<'_> {
    fn start(&mut self, element: &BytesStart<'_>) -> Result<(), MotionError> {
        match element.local_name().as_ref() {
            "subject" => self.subject(element)?,
            "segments" | "sensors" => element.local_name().as_ref().clone_into(&mut self.list),
            "segment" if self.list == "segments" => {
                let label = self.label(element)?;
                self.mvnx.segments.push(label);
                self.check_count(self.mvnx.segments.len(), "segments")?;
            }
            "sensor" if self.list == "sensors" => {
                let label = self.label(element)?;
                self.mvnx.sensors.push(label);
                self.check_count(self.mvnx.sensors.len(), "sensors")?;
            }
            "frame" => self.frame(element)?,
            other if self.in_frame => {
                let mut fields = FIELDS.iter();
                self.field = fields.position(|(name, _)| *name == other);
                if let Some(field) = self.field
                    && std::mem::replace(&mut self.seen[field], true)
                {
                    return Err(self.wrong("each list once a frame", other));
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn end(&mut self, name: &str) -> Result<(), MotionError> {
        self.field = None;
        if name == self.list {
            self.list.clear();
        }
        if name == "frame" && std::mem::take(&mut self.in_frame) {
            return self.check_lists();
        }
        Ok(())
    }

    fn subject(&mut self, element: &BytesStart<'_>) -> Result<(), MotionError> {
        self.subjects += 1;
        if self.subjects > 1 {
            return Err(self.wrong("one subject; export each on its own", "a second one"));
        }
        let rate = self.attribute(element, "frameRate")?.unwrap_or_default();
        let rate_hz = rate.parse().ok().filter(|rate| RATES_HZ.contains(rate));
        self.mvnx.rate_hz =
            rate_hz.ok_or_else(|| self.wrong("a frameRate of 1 to 10000 Hz", &quoted(&rate)))?;
        let start = self.attribute(element, "recDateMSecsSinceEpoch")?;
        self.mvnx.start_ms = start.and_then(|start| start.parse().ok());
        Ok(())
    }

    fn frame(&mut self, element: &BytesStart<'_>) -> Result<(), MotionError> {
        let kind = self.attribute(element, "type")?;
        // Old files have no types, and no frames but the recording's.
        self.in_frame = kind.is_none_or(|kind| kind == "normal");
        if !self.in_frame {
            return Ok(());
        }
        self.seen = [false; FIELDS.len()];
        if self.mvnx.segments.is_empty() {
            return Err(self.wrong("the labels of segments before the first frame", "none"));
        }
        let next = self
            .mvnx
            .frames
            .last()
            .map_or(0, |last| last.saturating_add(1));
        let index = match self.attribute(element, "index")? {
            Some(index) => index
                .parse()
                .map_err(|_| self.wrong("a frame's whole number as index", &quoted(&index)))?,
            None => next,
        };
        if !self.mvnx.frames.is_empty() && index != next {
            let expected = format!("frame {next}, so that none is missing; export all frames");
            return Err(self.wrong(&expected, &format!("frame {index}")));
        }
        self.mvnx.frames.push(index);
        Ok(())
    }

    /// Adds the numbers of the list that is open.
    fn numbers(&mut self, text: &str) -> Result<(), MotionError> {
        let Some(field) = self.field else {
            return Ok(());
        };
        let (name, field) = FIELDS[field];
        let labels = match field.is_of_sensors() {
            true => self.mvnx.sensors.len(),
            false => self.mvnx.segments.len(),
        };
        let width = if field.is_turn() { 4 } else { 3 };
        let mut numbers = [0.0; 4];
        let mut count = 0;
        for word in text.split_ascii_whitespace() {
            let number = word.parse().ok();
            let number = number.filter(|number: &f64| number.abs() < MAX_VALUE);
            numbers[count % width] =
                number.ok_or_else(|| self.wrong(&format!("a number of {name}"), &quoted(word)))?;
            count += 1;
            if count % width == 0 && count <= labels * width {
                self.push(field, numbers)?;
            }
        }
        if count != labels * width {
            let expected = format!(
                "{} numbers of {name} ({width} for each of {labels})",
                labels * width
            );
            return Err(self.wrong(&expected, &count.to_string()));
        }
        Ok(())
    }

    fn push(&mut self, field: Field, [a, b, c, d]: [f64; 4]) -> Result<(), MotionError> {
        if !field.is_turn() {
            let vectors = match field {
                Field::Position => &mut self.mvnx.positions,
                Field::AngularVelocity => &mut self.mvnx.angular_velocities,
                _ => &mut self.mvnx.sensor_free_accelerations,
            };
            vectors.push(Vector3::new(a, b, c));
            return Ok(());
        }
        let quaternion = Quaternion::new(a, b, c, d);
        let length = quaternion.norm();
        if (length - 1.0).abs() > LENGTH_TOLERANCE {
            let expected = "quaternions (w x y z) of length 1 within 0.01";
            return Err(self.wrong(expected, &format!("one of length {length}")));
        }
        let turn = UnitQuaternion::new_normalize(quaternion);
        match field {
            Field::Orientation => self.mvnx.orientations.push(turn),
            _ => self.mvnx.sensor_orientations.push(turn),
        }
        Ok(())
    }

    /// Every list has as many entries as there are frames, or none.
    fn check_lists(&self) -> Result<(), MotionError> {
        let mvnx = &self.mvnx;
        let frames = mvnx.frames.len();
        let (segments, sensors) = (frames * mvnx.segments.len(), frames * mvnx.sensors.len());
        for (name, found, expected, is_needed) in [
            ("orientation", mvnx.orientations.len(), segments, true),
            ("position", mvnx.positions.len(), segments, true),
            (
                "angularVelocity",
                mvnx.angular_velocities.len(),
                segments,
                false,
            ),
            (
                "sensorOrientation",
                mvnx.sensor_orientations.len(),
                sensors,
                false,
            ),
            (
                "sensorFreeAcceleration",
                mvnx.sensor_free_accelerations.len(),
                sensors,
                false,
            ),
        ] {
            if found != expected && (is_needed || found != 0) {
                return Err(self.wrong(&format!("{name} in every frame"), "a frame without"));
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<Mvnx, MotionError> {
        if self.depth > 0 {
            return Err(self.wrong("</mvnx>; the file is cut off", "the end of the file"));
        }
        if self.mvnx.frames.is_empty() {
            return Err(self.wrong("frames of type normal", "none"));
        }
        Ok(self.mvnx)
    }

    fn label(&self, element: &BytesStart<'_>) -> Result<String, MotionError> {
        let label = self.attribute(element, "label")?;
        label.ok_or_else(|| self.wrong("a label", element.local_name().as_ref()))
    }

    fn attribute(
        &self,
        element: &BytesStart<'_>,
        name: &str,
    ) -> Result<Option<String>, MotionError> {
        let found = element.try_get_attribute(name);
        let found = found.map_err(|error| self.wrong("attributes", &error.to_string()))?;
        Ok(found.map(|attribute| attribute.value.trim().to_owned()))
    }

    fn check_count(&self, count: usize, what: &'static str) -> Result<(), MotionError> {
        if count <= MAX_JOINTS {
            return Ok(());
        }
        Err(MotionError::Limit {
            name: self.mvnx.name.clone(),
            line: self.line(),
            what,
            limit: MAX_JOINTS,
        })
    }

    fn wrong(&self, expected: &str, found: &str) -> MotionError {
        MotionError::Syntax {
            name: self.mvnx.name.clone(),
            line: self.line(),
            expected: expected.to_owned(),
            found: found.to_owned(),
        }
    }

    /// Where the reader is, 1-based.
    fn line(&self) -> usize {
        let read = usize::try_from(self.reader.buffer_position()).unwrap_or(usize::MAX);
        let before = &self.text.as_bytes()[..read.min(self.text.len())];
        1 + before.iter().filter(|byte| **byte == b'\n').count()
    }
}

fn quoted(word: &str) -> String {
    format!("\"{}\"", shortened(word))
}
