//! OptiTrack: what Motive exports as CSV, from format version 1.2 on, with its header.
//!
//! The first line holds keys and values in turn (frame rates, rotation type, length units,
//! coordinate space); behind it stand rows with each column's type, name, ID, in some versions its
//! parent, and what it is, down to the one that begins with `Frame`. Of each rigid body and bone
//! there are three position columns and a rotation: a quaternion (X, Y, Z, W), or three angles in
//! degrees, turned about the axes in the order that the rotation type names, each as the turns
//! before it left it. What was not seen has empty cells. Motive's y axis is up unless the export
//! had axes of its own.

use std::collections::BTreeMap;

use cromosim_motion::UpAxis;
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

use super::DatasetRecording;
use super::capture::{Bodies, BodyPose, content, euler_order, from_euler, on_grid};
use crate::rigid::RigidError;
use crate::rigid::header::line_of;
use crate::rigid::table::{Row, text};

/// Rows of a header before the one that begins with `Frame`: type, name, ID, parent, what it is;
/// one more is no export.
const MOST_HEADER_ROWS: usize = 8;

/// Whether the header has columns of rigid bodies or bones; `start` holds all of it.
pub(super) fn has_bodies(start: &str) -> bool {
    let header = start
        .lines()
        .take(MOST_HEADER_ROWS)
        .take_while(|line| !line.to_lowercase().starts_with("frame,"));
    let mut cells = header.flat_map(|line| line.split(','));
    cells.any(|cell| is_body(cell.trim()))
}

/// Whether a column of this type is a body's.
fn is_body(kind: &str) -> bool {
    let kind = kind.to_lowercase().replace(' ', "");
    matches!(kind.as_str(), "rigidbody" | "bone")
}

/// Reads rigid bodies and skeletons' bones as references, one a name. Stamps count from the take's
/// beginning; positions become metres and z up, `up` being the axis of the file that points up (y
/// where it is to be found out). The bodies' own axes stay as Motive has them.
///
/// # Errors
/// [`RigidError::Content`], [`RigidError::Value`], [`RigidError::Order`],
/// [`RigidError::Quaternion`], [`RigidError::Empty`], [`RigidError::Csv`].
pub fn parse_optitrack(
    bytes: &[u8],
    name: &str,
    up: UpAxis,
) -> Result<DatasetRecording, RigidError> {
    let text = text(bytes, name)?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut records = reader.records().map(|record| {
        record.map_err(|source| RigidError::Csv {
            name: name.to_owned(),
            source,
        })
    });
    let first = records.next().transpose()?.unwrap_or_default();
    let header = Header::of(&first, name)?;
    let mut rows = Vec::new();
    let columns = loop {
        let Some(row) = records.next().transpose()? else {
            return Err(no_columns(name));
        };
        if row
            .get(0)
            .is_some_and(|cell| cell.eq_ignore_ascii_case("frame"))
        {
            let line = line_of(&row, text);
            break Columns::of(&rows, &row, &header, (name, line))?;
        }
        rows.push(row);
        if rows.len() > MOST_HEADER_ROWS {
            return Err(no_columns(name));
        }
    };
    let up = if up == UpAxis::Detect { UpAxis::Y } else { up };
    let mut bodies = Bodies::new(columns.bodies.iter().map(|body| body.name.as_str()), up);
    let mut last = None;
    for record in records {
        let record = record?;
        let row = Row {
            name,
            line: line_of(&record, text),
            cells: record.iter().collect(),
        };
        let stamp = Stamp::from_seconds(on_grid(row.number(1)?, header.rate_hz));
        row.check_order(stamp, last.as_ref())?;
        last = Some(stamp);
        for (index, body) in columns.bodies.iter().enumerate() {
            bodies.push(index, stamp, body.pose(&row, &header)?);
        }
    }
    bodies.into_recording(name, header.rate_hz, header.notes(columns.others))
}

fn no_columns(name: &str) -> RigidError {
    let problem = "no row of columns that begins with Frame; export with Motive's header";
    content(name, "header", problem)
}

/// What the first line says.
struct Header {
    rate_hz: f64,
    rotation: RotationType,
    metres: f64,
    started: Option<String>,
}

#[derive(Clone, Copy)]
enum RotationType {
    Quaternion,
    Euler([usize; 3]),
}

impl Header {
    fn of(first: &csv::StringRecord, name: &str) -> Result<Self, RigidError> {
        let cells: Vec<&str> = first.iter().collect();
        let pairs: BTreeMap<String, &str> = cells
            .chunks(2)
            .filter_map(|pair| Some((pair[0].to_lowercase(), *pair.get(1)?)))
            .collect();
        let say = |key: &str| pairs.get(key).copied().unwrap_or_default();
        let wrong = |key: &str, expected: &str| {
            let found = say(key);
            content(name, "line 1", format!("{key} \"{found}\": {expected}"))
        };
        let rate_hz = ["export frame rate", "capture frame rate"]
            .iter()
            .find_map(|key| say(key).parse().ok())
            .filter(|rate: &f64| (1e-3..1e6).contains(rate))
            .ok_or_else(|| wrong("export frame rate", "expected frames a second"))?;
        let rotation = match say("rotation type") {
            kind if kind.eq_ignore_ascii_case("quaternion") => RotationType::Quaternion,
            kind => RotationType::Euler(euler_order(kind).ok_or_else(|| {
                wrong(
                    "rotation type",
                    "expected Quaternion or an order of axes such as XYZ",
                )
            })?),
        };
        let metres = match say("length units").to_lowercase().as_str() {
            "meters" => 1.0,
            "centimeters" => 1e-2,
            "millimeters" => 1e-3,
            "inches" => 0.0254,
            "feet" => 0.3048,
            _ => {
                let expected = "expected Meters, Centimeters, Millimeters, Inches or Feet";
                return Err(wrong("length units", expected));
            }
        };
        let space = say("coordinate space");
        if !(space.is_empty() || space.eq_ignore_ascii_case("global")) {
            let problem = "poses have to be in the world; export with Global coordinates";
            return Err(wrong("coordinate space", problem));
        }
        let started = Some(say("capture start time")).filter(|it| !it.is_empty());
        Ok(Self {
            rate_hz,
            rotation,
            metres,
            started: started.map(str::to_owned),
        })
    }

    fn notes(&self, others: usize) -> Vec<String> {
        let started = self.started.as_ref().map(|started| {
            format!(
                "stamps count from the beginning of the take, {started} by its computer's clock"
            )
        });
        let others = (others > 0).then(|| {
            format!(
                "{others} columns of markers and others are left alone (bodies and bones are read)"
            )
        });
        started.into_iter().chain(others).collect()
    }
}

/// Which column is whose.
struct Columns {
    bodies: Vec<Body>,
    /// Columns of markers and other things.
    others: usize,
}

/// A body's columns.
struct Body {
    name: String,
    position: [usize; 3],
    /// x, y, z and, of quaternions, w.
    rotation: Vec<usize>,
}

impl Columns {
    fn of(
        rows: &[csv::StringRecord],
        axes: &csv::StringRecord,
        header: &Header,
        (name, line): (&str, usize),
    ) -> Result<Self, RigidError> {
        let [kinds, names, .., parts] = rows else {
            let problem = "expected rows with each column's type, name and property above the one that begins with Frame";
            return Err(content(name, "header", problem));
        };
        let cell = |row: &csv::StringRecord, column| row.get(column).unwrap_or_default().to_owned();
        let mut found: Vec<(String, BTreeMap<String, usize>)> = Vec::new();
        let mut others = 0;
        for column in 2..axes.len() {
            let kind = cell(kinds, column);
            if !is_body(&kind) {
                others += usize::from(!kind.is_empty());
                continue;
            }
            let owner = cell(names, column);
            let part = format!("{} {}", cell(parts, column), cell(axes, column)).to_lowercase();
            match found.iter_mut().find(|(name, _)| *name == owner) {
                Some((_, columns)) => {
                    columns.entry(part).or_insert(column);
                }
                None => found.push((owner, BTreeMap::from([(part, column)]))),
            }
        }
        let of_quaternion = matches!(header.rotation, RotationType::Quaternion);
        let letters = if of_quaternion { "xyzw" } else { "xyz" };
        let mut bodies = Vec::new();
        for (owner, columns) in found {
            let need = |part: String| {
                let missing = || {
                    let problem =
                        format!("{owner} has no column \"{part}\"; export rotation and position");
                    content(name, format!("line {line}"), problem)
                };
                columns.get(&part).copied().ok_or_else(missing)
            };
            let mut position = [0; 3];
            for (own, axis) in position.iter_mut().zip("xyz".chars()) {
                *own = need(format!("position {axis}"))?;
            }
            let rotation = letters.chars().map(|axis| need(format!("rotation {axis}")));
            bodies.push(Body {
                rotation: rotation.collect::<Result<_, _>>()?,
                position,
                name: owner,
            });
        }
        if bodies.is_empty() {
            let problem = "no rigid bodies and no bones in it; export them, too";
            return Err(content(name, format!("line {line}"), problem));
        }
        Ok(Self { bodies, others })
    }
}

impl Body {
    /// The pose in a row, in the file's axes, m; none where the body was not seen.
    fn pose(&self, row: &Row<'_>, header: &Header) -> Result<Option<BodyPose>, RigidError> {
        let mut columns = self.position.iter().chain(&self.rotation);
        if columns.any(|column| row.cells.get(*column).is_none_or(|cell| cell.is_empty())) {
            return Ok(None);
        }
        let vector = |[x, y, z]: [usize; 3]| {
            Ok::<_, RigidError>(Vector3::new(row.number(x)?, row.number(y)?, row.number(z)?))
        };
        let rotation = match (header.rotation, self.rotation.as_slice()) {
            (RotationType::Euler(order), [x, y, z]) => {
                from_euler(order, vector([*x, *y, *z])?.map(f64::to_radians))
            }
            (_, [x, y, z, w]) => row.rotation([*x, *y, *z, *w])?,
            _ => return Ok(None),
        };
        Ok(Some((vector(self.position)? * header.metres, rotation)))
    }
}
