//! TRC (Motion Analysis, OpenSim): marker positions as a table of text.

use std::fmt::Write;

use nalgebra::Point3;

use crate::MotionError;
use crate::markers::{MarkerClip, checked_rate, unit_scale};
use crate::text::{Cursor, MAX_VALUE, Token, without_byte_order_mark};

/// The largest number of markers that is read.
const MAX_MARKERS: usize = 10_000;

/// Whether a text begins like a TRC file.
pub(crate) fn is_trc(start: &str) -> bool {
    start
        .get(..12)
        .is_some_and(|word| word.eq_ignore_ascii_case("PathFileType"))
}

/// What the second and third line say.
struct Header {
    rate_hz: f64,
    unit_scale_m: f64,
    frames: usize,
    markers: usize,
    line: usize,
}

/// Parses the text of a TRC file; `name` stands in the errors. No file is touched.
///
/// Columns are separated by tabs, or by spaces where a line has no tab; empty cells and `NaN` are
/// markers that were not seen, and so is the exact origin. Units may be mm, cm, m, in or ft.
///
/// # Errors
/// [`MotionError::Syntax`], [`MotionError::FrameCount`], [`MotionError::Limit`],
/// [`MotionError::Setting`], with the line where there is one. A point takes a byte of the text at
/// least: memory stays proportional to it.
pub fn parse_trc(text: &str, name: &str) -> Result<MarkerClip, MotionError> {
    let text = without_byte_order_mark(text);
    let mut cursor = Cursor::new(text, name);
    let first = cursor.next_line();
    if !first.is_some_and(|line| is_trc(line.text)) {
        return Err(cursor.unexpected("PathFileType", first));
    }
    let header = header(&mut cursor)?;
    let labels = labels(&mut cursor, &header)?;
    let mut frames = Vec::new();
    let mut found = 0;
    let mut last_line = cursor.line();
    while let Some(line) = cursor.next_line() {
        if found == 0 && line.text.starts_with(['X', 'x']) {
            continue;
        }
        if found < header.frames {
            if (frames.len() + 1).saturating_mul(header.markers) > text.len() {
                return Err(cursor.unexpected(
                    "a cell for every coordinate, empty where a marker was not seen",
                    Some(line),
                ));
            }
            frames.push(frame(&cursor, line, &header)?);
        }
        found += 1;
        last_line = line.line;
    }
    if found != header.frames {
        let (name, expected) = (name.to_owned(), header.frames);
        return Err(MotionError::FrameCount {
            name,
            line: last_line,
            expected,
            found,
            declared_at: header.line,
        });
    }
    Ok(MarkerClip {
        name: name.to_owned(),
        rate_hz: header.rate_hz,
        unit_scale_m: header.unit_scale_m,
        labels,
        frames,
    })
}

fn header(cursor: &mut Cursor<'_>) -> Result<Header, MotionError> {
    let names = cursor.next_line();
    let Some(names) = names.filter(|line| line.text.starts_with("DataRate")) else {
        return Err(cursor.unexpected("DataRate", names));
    };
    let Some(values) = cursor.next_line() else {
        return Err(cursor.unexpected("the numbers of the header", None));
    };
    let value = |key: &str| {
        let column = names
            .text
            .split_whitespace()
            .position(|name| name.eq_ignore_ascii_case(key));
        let word = column.and_then(|column| values.text.split_whitespace().nth(column));
        word.ok_or_else(|| cursor.unexpected(&format!("a value of {key}"), Some(values)))
    };
    let token = |text| Token {
        text,
        line: values.line,
    };
    let count = |key: &str| {
        let word = value(key)?;
        let number = word.parse::<usize>().ok().filter(|&number| number > 0);
        number.ok_or_else(|| cursor.unexpected(&format!("{key}, at least 1"), Some(token(word))))
    };
    let (unit, markers) = (value("Units")?, count("NumMarkers")?);
    if markers > MAX_MARKERS {
        return Err(MotionError::Limit {
            name: cursor.name().to_owned(),
            line: values.line,
            what: "markers",
            limit: MAX_MARKERS,
        });
    }
    Ok(Header {
        rate_hz: checked_rate(
            cursor.name(),
            cursor.parse_number(token(value("DataRate")?), "a number of DataRate", 1)?,
        )?,
        unit_scale_m: unit_scale(unit)
            .ok_or_else(|| cursor.unexpected("Units of mm, cm, m, in or ft", Some(token(unit))))?,
        frames: count("NumFrames")?,
        markers,
        line: values.line,
    })
}

/// `Frame#  Time  LFHD  …`
fn labels(cursor: &mut Cursor<'_>, header: &Header) -> Result<Vec<String>, MotionError> {
    let line = cursor.next_line();
    let Some(line) = line.filter(|line| line.text.to_ascii_lowercase().starts_with("frame")) else {
        return Err(cursor.unexpected("Frame#, Time and the markers' labels", line));
    };
    let labels: Vec<String> = cells(line.text)
        .map(str::trim)
        .filter(|cell| !cell.is_empty())
        .skip(2)
        .map(str::to_owned)
        .collect();
    if labels.len() != header.markers {
        let found = format!("{} labels", labels.len());
        let expected = format!("{} labels (as line {} says)", header.markers, header.line);
        return Err(cursor.unexpected(
            &expected,
            Some(Token {
                text: &found,
                line: line.line,
            }),
        ));
    }
    Ok(labels)
}

fn cells(line: &str) -> impl Iterator<Item = &str> {
    let tabs = line.contains('\t');
    line.split(move |c: char| if tabs { c == '\t' } else { c.is_whitespace() })
        .filter(move |cell| tabs || !cell.is_empty())
}

fn frame(
    cursor: &Cursor<'_>,
    line: Token<'_>,
    header: &Header,
) -> Result<Vec<Option<Point3<f64>>>, MotionError> {
    let mut points = Vec::with_capacity(header.markers);
    let mut numbers = cells(line.text).map(str::trim);
    // Frame number and time: the rate says the time.
    for what in ["the frame's number", "the frame's time"] {
        let word = numbers.next().unwrap_or_default();
        if word.parse::<f64>().is_err() {
            return Err(cursor.unexpected(
                what,
                Some(Token {
                    text: word,
                    line: line.line,
                }),
            ));
        }
    }
    let mut coordinate = || match numbers.next() {
        None | Some("") => Ok(None),
        Some(word) => match word.parse::<f64>() {
            Ok(number) => Ok(Some(number).filter(|number| number.abs() < MAX_VALUE)),
            Err(_) => Err(cursor.unexpected(
                "a coordinate",
                Some(Token {
                    text: word,
                    line: line.line,
                }),
            )),
        },
    };
    for _ in 0..header.markers {
        let [x, y, z] = [coordinate()?, coordinate()?, coordinate()?];
        let place = x
            .zip(y)
            .zip(z)
            .map(|((x, y), z)| Point3::new(x, y, z))
            .filter(|place| *place != Point3::origin());
        points.push(place.map(|place| place * header.unit_scale_m));
    }
    if numbers.any(|cell| !cell.is_empty()) {
        let found = format!("more than {} coordinates", 3 * header.markers);
        return Err(cursor.unexpected(
            &format!("{} coordinates", 3 * header.markers),
            Some(Token {
                text: &found,
                line: line.line,
            }),
        ));
    }
    Ok(points)
}

/// Writes markers as TRC in millimetres, in their own axes; what was not seen has empty cells. The
/// inverse of [`parse_trc`] but for rounding to a nanometre.
pub fn write_trc(clip: &MarkerClip) -> String {
    let (frames, markers, rate) = (clip.frames.len(), clip.labels.len(), clip.rate_hz);
    let mut text = "PathFileType\t4\t(X/Y/Z)\tmarkers.trc\n".to_owned();
    text += "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n";
    let _ = writeln!(
        text,
        "{rate}\t{rate}\t{frames}\t{markers}\tmm\t{rate}\t1\t{frames}"
    );
    let _ = writeln!(text, "Frame#\tTime\t{}", clip.labels.join("\t\t\t"));
    let axes: Vec<String> = (1..=markers)
        .map(|number| format!("X{number}\tY{number}\tZ{number}"))
        .collect();
    let _ = writeln!(text, "\t\t{}\n", axes.join("\t"));
    for (index, frame) in clip.frames.iter().enumerate() {
        let _ = write!(text, "{}\t{:.6}", index + 1, index as f64 / rate);
        for point in frame {
            let _ = match point {
                Some(p) => write!(
                    text,
                    "\t{:.6}\t{:.6}\t{:.6}",
                    1e3 * p.x,
                    1e3 * p.y,
                    1e3 * p.z
                ),
                None => write!(text, "\t\t\t"),
            };
        }
        text.push('\n');
    }
    text
}
