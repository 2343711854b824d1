//! Markers in the tables that motion capture systems export as CSV: Motive's (OptiTrack) columns of
//! type `Marker`, and the `Trajectories` of Vicon's Nexus and Tracker. What else such tables hold,
//! rigid bodies and segments, is no business of a body's motion.

use nalgebra::Point3;

use crate::MotionError;
use crate::markers::{MarkerClip, checked_rate, unit_scale};
use crate::text::{MAX_VALUE, Token, shortened, without_byte_order_mark};

/// What sections of Vicon's tables are called, in lower case; `objects` and `segments` hold poses.
pub const VICON_SECTIONS: [&str; 9] = [
    "objects",
    "segments",
    MARKERS,
    "model outputs",
    "devices",
    "joints",
    "bones",
    "events",
    "centers of mass",
];
const MARKERS: &str = "trajectories";
/// How Motive's tables begin.
const MOTIVE: &str = "format version";
/// Rows of Motive's header above the one that begins with Frame: at most type, name, ID, parent,
/// property.
const MOST_HEADER_ROWS: usize = 8;

/// Whether a text begins like Motive's export.
pub(crate) fn is_motive(start: &str) -> bool {
    let start = start.get(..MOTIVE.len());
    start.is_some_and(|start| start.eq_ignore_ascii_case(MOTIVE))
}

/// Whether a text begins like Vicon's export: with a section's name, and its rate below.
pub(crate) fn is_vicon(start: &str) -> bool {
    let mut lines = start.lines().map(bare);
    let known = lines
        .next()
        .is_some_and(|name| VICON_SECTIONS.contains(&name.as_str()));
    known && lines.next().is_some_and(|rate| rate.parse::<f64>().is_ok())
}

/// A line without the delimiters behind it, in lower case.
fn bare(line: &str) -> String {
    let line = line.trim_end_matches([',', ';', '\t', ' ', '\r']);
    line.trim().trim_matches('"').to_lowercase()
}

/// The lines of a table with their numbers.
struct Table<'a> {
    name: &'a str,
    bytes: usize,
    lines: Vec<Token<'a>>,
}

impl<'a> Table<'a> {
    fn of(text: &'a str, name: &'a str) -> Self {
        let lines = without_byte_order_mark(text).lines().enumerate();
        let lines = lines.map(|(index, text)| Token {
            text: text.trim_end_matches('\r'),
            line: index + 1,
        });
        Self {
            name,
            bytes: text.len(),
            lines: lines.collect(),
        }
    }

    fn wrong(&self, line: usize, expected: &str, found: &str) -> MotionError {
        MotionError::Syntax {
            name: self.name.to_owned(),
            line,
            expected: expected.to_owned(),
            found: shortened(found),
        }
    }

    /// The points of each row, m; none where a marker was not seen. A point takes a byte of the
    /// text at least: memory stays proportional to it.
    fn frames<'r>(
        &self,
        rows: impl Iterator<Item = (usize, Vec<&'r str>)>,
        markers: &[Marker],
        metres: f64,
    ) -> Result<Vec<Vec<Option<Point3<f64>>>>, MotionError> {
        let mut frames = Vec::new();
        for (line, cells) in rows {
            if (frames.len() + 1).saturating_mul(markers.len()) > self.bytes {
                let expected = "a cell for every coordinate, empty where a marker was not seen";
                return Err(self.wrong(line, expected, &format!("{} cells", cells.len())));
            }
            frames.push(self.points(&cells, line, markers, metres)?);
        }
        Ok(frames)
    }

    fn points(
        &self,
        cells: &[&str],
        line: usize,
        markers: &[Marker],
        metres: f64,
    ) -> Result<Vec<Option<Point3<f64>>>, MotionError> {
        let coordinate = |column: usize| match cells.get(column).copied().unwrap_or_default() {
            "" => Ok(None),
            cell => match cell.parse::<f64>() {
                Ok(number) => Ok(Some(number).filter(|number| number.abs() < MAX_VALUE)),
                Err(_) => Err(self.wrong(line, "a coordinate", cell)),
            },
        };
        let point = |marker: &Marker| {
            let [x, y, z] = marker.columns.map(coordinate);
            let (x, y, z) = (x?, y?, z?);
            let place = x.zip(y).zip(z);
            Ok(place.map(|((x, y), z)| Point3::new(x, y, z) * metres))
        };
        markers.iter().map(point).collect()
    }
}

/// A marker's columns.
struct Marker {
    label: String,
    columns: [usize; 3],
}

fn cells(line: &str, delimiter: char) -> Vec<&str> {
    let cells = line.split(delimiter);
    cells.map(|cell| cell.trim().trim_matches('"')).collect()
}

/// Parses Motive's export; `name` stands in the errors. No file is touched.
///
/// # Errors
/// [`MotionError::Syntax`] with the line; [`MotionError::Setting`] for a rate that none has.
pub fn parse_motive_markers(text: &str, name: &str) -> Result<MarkerClip, MotionError> {
    let table = Table::of(text, name);
    let rows: Vec<(usize, Vec<&str>)> = table
        .lines
        .iter()
        .filter(|line| !bare(line.text).is_empty())
        .map(|line| (line.line, cells(line.text, ',')))
        .collect();
    let first = rows.first().map_or(&[][..], |(_, cells)| cells);
    let say = |key: &str| {
        let mut pairs = first.chunks_exact(2);
        let pair = pairs.find(|pair| pair[0].eq_ignore_ascii_case(key));
        pair.map_or("", |pair| pair[1])
    };
    let rate = ["export frame rate", "capture frame rate"]
        .iter()
        .find_map(|key| say(key).parse().ok())
        .ok_or_else(|| table.wrong(1, "an export frame rate", "none"))?;
    let metres = unit_scale(say("length units"))
        .ok_or_else(|| table.wrong(1, "length units such as Meters", say("length units")))?;
    let is_frame = |(_, cells): &(usize, Vec<&str>)| cells[0].eq_ignore_ascii_case("frame");
    let columns = rows.iter().take(MOST_HEADER_ROWS).position(is_frame);
    let header = columns.map_or(&[][..], |columns| &rows[1..=columns]);
    let [(_, kinds), (_, names), .., (line, axes)] = header else {
        return Err(table.wrong(1, "a row of columns that begins with Frame", "none"));
    };
    let mut markers: Vec<Marker> = Vec::new();
    for column in 2..axes.len().saturating_sub(2) {
        let own =
            |row: &[&str], column: usize| row.get(column).copied().unwrap_or_default().to_owned();
        let is_marker = own(kinds, column).eq_ignore_ascii_case("marker");
        if is_marker && axes[column..column + 3] == ["X", "Y", "Z"] {
            markers.push(Marker {
                label: own(names, column),
                columns: [column, column + 1, column + 2],
            });
        }
    }
    if markers.is_empty() {
        let expected = "columns of type Marker; export labelled markers";
        return Err(table.wrong(*line, expected, "none"));
    }
    let rows = rows.iter().skip(header.len() + 1);
    let rows = rows.map(|(line, cells)| (*line, cells.clone()));
    let frames = table.frames(rows, &markers, metres)?;
    clip(&table, rate, metres, markers, frames)
}

/// Parses the trajectories in Vicon's export; `name` stands in the errors. No file is touched.
///
/// # Errors
/// As [`parse_motive_markers`].
pub fn parse_vicon_markers(text: &str, name: &str) -> Result<MarkerClip, MotionError> {
    let table = Table::of(text, name);
    let is_section = |line: &Token<'_>| bare(line.text) == MARKERS;
    let Some(start) = table.lines.iter().position(is_section) else {
        return Err(table.wrong(1, "a section called Trajectories; export markers", "none"));
    };
    let body = table.lines[start + 1..].iter();
    let body: Vec<&Token<'_>> = body
        .take_while(|line| !bare(line.text).is_empty())
        .collect();
    let [rate, names, columns, units, rows @ ..] = body.as_slice() else {
        let expected = "rate, names, columns and units below Trajectories";
        return Err(table.wrong(table.lines[start].line, expected, "the end"));
    };
    let delimiter = [',', ';', '\t']
        .into_iter()
        .max_by_key(|delimiter| columns.text.matches(*delimiter).count())
        .unwrap_or(',');
    let rate_hz = bare(rate.text).parse();
    let rate_hz = rate_hz.map_err(|_| table.wrong(rate.line, "a rate in Hz", rate.text))?;
    let names = cells(names.text, delimiter);
    let (axes, units_cells) = (cells(columns.text, delimiter), cells(units.text, delimiter));
    let mut markers = Vec::new();
    let mut unit = "";
    for (column, label) in names.iter().enumerate().skip(2) {
        let is_point = axes.get(column..column + 3) == Some(&["X", "Y", "Z"][..]);
        if is_point && !label.is_empty() {
            if markers.is_empty() {
                unit = units_cells.get(column).copied().unwrap_or_default();
            }
            markers.push(Marker {
                label: (*label).to_owned(),
                columns: [column, column + 1, column + 2],
            });
        }
    }
    if markers.is_empty() {
        return Err(table.wrong(
            columns.line,
            "columns X, Y, Z below a marker's name",
            "none",
        ));
    }
    let metres = unit_scale(unit).ok_or_else(|| table.wrong(units.line, "mm, cm or m", unit))?;
    let rows = rows.iter();
    let rows = rows.map(|row| (row.line, cells(row.text, delimiter)));
    let frames = table.frames(rows, &markers, metres)?;
    clip(&table, rate_hz, metres, markers, frames)
}

fn clip(
    table: &Table<'_>,
    rate_hz: f64,
    unit_scale_m: f64,
    markers: Vec<Marker>,
    frames: Vec<Vec<Option<Point3<f64>>>>,
) -> Result<MarkerClip, MotionError> {
    if frames.is_empty() {
        let last = table.lines.last().map_or(1, |line| line.line);
        return Err(table.wrong(last, "frames", "none"));
    }
    Ok(MarkerClip {
        name: table.name.to_owned(),
        rate_hz: checked_rate(table.name, rate_hz)?,
        unit_scale_m,
        labels: markers.into_iter().map(|marker| marker.label).collect(),
        frames,
    })
}
