//! Vicon: what Nexus and Tracker export as CSV.
//!
//! A file is one section after another, with an empty line between: its name (`Objects`,
//! `Segments`, `Trajectories`, `Devices` ...), its rate in Hz, the names of what it holds, each
//! above its first column, the columns (`Frame`, `Sub Frame`, `RX` ...), their units, and a row a
//! frame. Of each object and segment there are TX TY TZ and a rotation: RX RY RZ RW, a quaternion;
//! else RX RY RZ, which is a helical vector (the axis, as long as the angle) unless the name says
//! Euler with an order of axes. What was not seen has empty cells. Vicon's z axis is up unless the
//! volume was set up otherwise.

use cromosim_motion::{UpAxis, VICON_SECTIONS};
use cromosim_spatial::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

use super::DatasetRecording;
use super::capture::{Bodies, BodyPose, content, euler_order, from_euler};
use crate::rigid::RigidError;
use crate::rigid::table::{Row, text};

/// Sections with poses.
const POSES: [&str; 2] = ["objects", "segments"];
/// Words in front of a name that say how its rotation is given.
const ANGLES: [&str; 2] = ["Global Angle", "Local Angle"];

/// Whether any section of the text holds poses.
pub(super) fn has_poses(text: &str) -> bool {
    let mut lines = text.lines();
    lines.any(|line| POSES.contains(&bare(line).as_str()))
}

/// A line without the delimiters behind it, in lower case.
fn bare(line: &str) -> String {
    let line = line.trim_end_matches([',', ';', '\t', ' ', '\r']);
    line.trim().trim_matches('"').to_lowercase()
}

fn is_section(name: &str) -> bool {
    VICON_SECTIONS.contains(&name)
}

/// Reads objects and segments as references, one a name. A frame's stamp is its number by the rate;
/// positions become metres and z up, `up` being the axis of the file that points up (z where it is
/// to be found out).
///
/// # Errors
/// [`RigidError::Content`], [`RigidError::Value`], [`RigidError::Order`],
/// [`RigidError::Quaternion`], [`RigidError::Empty`].
pub fn parse_vicon(bytes: &[u8], name: &str, up: UpAxis) -> Result<DatasetRecording, RigidError> {
    let text = text(bytes, name)?;
    let mut lines = text.lines().enumerate().peekable();
    let (mut all, mut skipped) = (DatasetRecording::default(), Vec::new());
    let mut found = false;
    while let Some((index, line)) = lines.next() {
        let section = bare(line);
        if section.is_empty() {
            continue;
        }
        let mut body = Vec::new();
        while let Some((index, line)) = lines.next_if(|(_, line)| !bare(line).is_empty()) {
            body.push((index + 1, line));
        }
        if POSES.contains(&section.as_str()) {
            found = true;
            let read = Section::of(name, index + 1, &body)?.read(up)?;
            all.rate_hz = read.rate_hz;
            let is_new = |own: &str| all.reference(own).is_none();
            let new = read.references.into_iter().filter(|(own, _)| is_new(own));
            let new: Vec<_> = new.collect();
            all.references.extend(new);
            all.notes.extend(read.notes);
        } else if is_section(&section) {
            skipped.push(section);
        } else {
            let problem = format!(
                "expected the name of a section such as Objects or Segments, found \"{}\"",
                section.chars().take(40).collect::<String>()
            );
            return Err(content(name, format!("line {}", index + 1), problem));
        }
    }
    if !found {
        let problem = format!(
            "no Objects and no Segments, but {}; export them, too",
            skipped.join(", ")
        );
        return Err(content(name, "sections", problem));
    }
    if !skipped.is_empty() {
        all.notes
            .push(format!("sections left alone: {}", skipped.join(", ")));
    }
    name.clone_into(&mut all.name);
    Ok(all)
}

/// A section of poses.
struct Section<'a> {
    name: &'a str,
    rate_hz: f64,
    bodies: Vec<Body<'a>>,
    /// Names of what is given in its parent's axes.
    local: usize,
    rows: Vec<Row<'a>>,
}

/// A body's columns and their units.
struct Body<'a> {
    name: &'a str,
    position: [usize; 3],
    metres: f64,
    turn: Turn,
}

#[derive(Clone, Copy)]
enum Turn {
    /// x, y, z, w.
    Quaternion([usize; 4]),
    /// Radians a unit.
    Helical([usize; 3], f64),
    Euler([usize; 3], f64, [usize; 3]),
}

impl<'a> Section<'a> {
    /// `line` is that of its name, `body` what stands below.
    fn of(name: &'a str, line: usize, body: &[(usize, &'a str)]) -> Result<Self, RigidError> {
        let at = |line: usize, problem: String| content(name, format!("line {line}"), problem);
        let [
            (rate_line, rate),
            (_, names),
            (columns_line, columns),
            (units_line, units),
            rows @ ..,
        ] = body
        else {
            let problem = "expected rate, names, columns and units below the section's name";
            return Err(at(line, problem.to_owned()));
        };
        let rate_hz = bare(rate);
        let rate_hz = rate_hz
            .parse()
            .ok()
            .filter(|rate| (1e-3..1e6).contains(rate));
        let rate_hz = rate_hz
            .ok_or_else(|| at(*rate_line, "expected the section's rate in Hz".to_owned()))?;
        let delimiter = [',', ';', '\t']
            .into_iter()
            .max_by_key(|delimiter| columns.matches(*delimiter).count())
            .unwrap_or(',');
        let split = |line: &'a str| -> Vec<&'a str> {
            let cells = line
                .split(delimiter)
                .map(|cell| cell.trim().trim_matches('"'));
            cells.collect()
        };
        let (names, columns, units) = (split(names), split(columns), split(units));
        if !columns[0].eq_ignore_ascii_case("frame") {
            let problem = format!(
                "expected columns that begin with Frame, found {}",
                columns[0]
            );
            return Err(at(*columns_line, problem));
        }
        let (bodies, local) =
            bodies(&names, &columns, &units).map_err(|problem| at(*units_line, problem))?;
        let row = |(line, cells): &(usize, &'a str)| Row {
            name,
            line: *line,
            cells: split(cells),
        };
        Ok(Self {
            name,
            rate_hz,
            bodies,
            local,
            rows: rows.iter().map(row).collect(),
        })
    }

    fn read(self, up: UpAxis) -> Result<DatasetRecording, RigidError> {
        let counted = |row: &Row<'_>, column: usize| {
            let whole = row.cell(column)?.parse::<u32>();
            whole.map_err(|_| row.error(column, "a whole number"))
        };
        let mut frames = Vec::new();
        for row in &self.rows {
            frames.push([counted(row, 0)?, counted(row, 1)?]);
        }
        let sub_frames = frames
            .iter()
            .map(|[_, sub]| sub.saturating_add(1))
            .max()
            .unwrap_or(1);
        let mut bodies = Bodies::new(self.bodies.iter().map(|body| body.name), up);
        let mut last = None;
        for (row, [frame, sub]) in self.rows.iter().zip(frames) {
            let number = f64::from(frame) * f64::from(sub_frames) + f64::from(sub);
            let stamp = Stamp::from_seconds(number / self.rate_hz);
            row.check_order(stamp, last.as_ref())?;
            last = Some(stamp);
            for (index, body) in self.bodies.iter().enumerate() {
                bodies.push(index, stamp, body.pose(row)?);
            }
        }
        let local = (self.local > 0).then(|| {
            format!(
                "in their parents' axes, and left alone: {} of the columns' names",
                self.local
            )
        });
        let assumed = self
            .bodies
            .iter()
            .any(|body| matches!(body.turn, Turn::Euler(..)));
        let assumed = assumed.then(|| {
            "Euler angles are taken to turn about each axis as the turns before left it".to_owned()
        });
        let notes = local.into_iter().chain(assumed).collect();
        bodies.into_recording(self.name, self.rate_hz, notes)
    }
}

/// The bodies, and how many are left alone as they are in their parents' axes; or what is wrong
/// with the columns.
fn bodies<'a>(
    names: &[&'a str],
    columns: &[&'a str],
    units: &[&'a str],
) -> Result<(Vec<Body<'a>>, usize), String> {
    let starts = (2..names.len()).filter(|at| !names[*at].is_empty());
    let starts: Vec<usize> = starts.collect();
    let (mut bodies, mut local) = (Vec::new(), 0);
    for (number, start) in starts.iter().enumerate() {
        let end = starts.get(number + 1).copied().unwrap_or(columns.len());
        if names[*start].starts_with(ANGLES[1]) {
            local += 1;
            continue;
        }
        let own = columns.get(*start..end.min(columns.len()));
        let group = Group {
            title: names[*start],
            columns: own.unwrap_or_default(),
            units,
            start: *start,
        };
        bodies.push(group.body()?);
    }
    Ok((bodies, local))
}

/// The columns below a name.
struct Group<'a, 'b> {
    title: &'a str,
    columns: &'b [&'a str],
    units: &'b [&'a str],
    start: usize,
}

impl<'a> Group<'a, '_> {
    /// The body, or what is wrong with its columns.
    fn body(&self) -> Result<Body<'a>, String> {
        let (kind, name) = kind_and_name(self.title);
        let find = |wanted: &str| {
            let mut columns = self.columns.iter();
            columns
                .position(|column| column.eq_ignore_ascii_case(wanted))
                .map(|at| self.start + at)
        };
        let need = |wanted: &str| find(wanted).ok_or(format!("{name} has no column {wanted}"));
        let unit = |column: usize| self.units.get(column).copied().unwrap_or_default();
        let position = [need("TX")?, need("TY")?, need("TZ")?];
        let metres = match unit(position[0]) {
            "mm" => 1e-3,
            "cm" => 1e-2,
            "m" => 1.0,
            other => return Err(format!("{name}: TX in \"{other}\"; expected mm, cm or m")),
        };
        let [x, y, z] = [need("RX")?, need("RY")?, need("RZ")?];
        let kind = kind.to_lowercase();
        if let Some(w) = find("RW") {
            let turn = Turn::Quaternion([x, y, z, w]);
            return Ok(Body {
                name,
                position,
                metres,
                turn,
            });
        }
        let radians = match unit(x) {
            "deg" => 1_f64.to_radians(),
            "rad" => 1.0,
            other => return Err(format!("{name}: RX in \"{other}\"; expected deg or rad")),
        };
        let turn = match kind.find("euler") {
            None => Turn::Helical([x, y, z], radians),
            Some(at) => {
                let letters: String = kind[at + 5..]
                    .chars()
                    .filter(|letter| letter.is_ascii_alphanumeric())
                    .collect();
                let order = euler_order(&letters)
                    .ok_or(format!("{name}: Euler angles without an order such as XYZ"))?;
                Turn::Euler([x, y, z], radians, order)
            }
        };
        Ok(Body {
            name,
            position,
            metres,
            turn,
        })
    }
}

/// `Global Angle (Quaternion) wand:wand` is a quaternion of `wand:wand`.
fn kind_and_name(title: &str) -> (&str, &str) {
    let Some(rest) = ANGLES.iter().find_map(|angle| title.strip_prefix(angle)) else {
        return ("", title);
    };
    let rest = rest.trim_start();
    let inside = rest.strip_prefix('(').and_then(|rest| rest.split_once(')'));
    let (kind, name) = inside.unwrap_or(("", rest));
    (kind, name.trim())
}

impl Body<'_> {
    /// The pose in a row, in the file's axes, m; none where the body was not seen.
    fn pose(&self, row: &Row<'_>) -> Result<Option<BodyPose>, RigidError> {
        let turned: &[usize] = match &self.turn {
            Turn::Quaternion(columns) => columns,
            Turn::Helical(columns, _) | Turn::Euler(columns, ..) => columns,
        };
        let mut columns = self.position.iter().chain(turned);
        if columns.any(|column| row.cells.get(*column).is_none_or(|cell| cell.is_empty())) {
            return Ok(None);
        }
        let vector = |[x, y, z]: [usize; 3]| {
            Ok::<_, RigidError>(Vector3::new(row.number(x)?, row.number(y)?, row.number(z)?))
        };
        let rotation = match self.turn {
            Turn::Quaternion(columns) => row.rotation(columns)?,
            Turn::Helical(columns, radians) => {
                UnitQuaternion::from_scaled_axis(vector(columns)? * radians)
            }
            Turn::Euler(columns, radians, order) => from_euler(order, vector(columns)? * radians),
        };
        Ok(Some((vector(self.position)? * self.metres, rotation)))
    }
}
