//! Tables of poses with a header that names the columns: what `geometry_msgs/PoseStamped` becomes in a spreadsheet.

use std::fmt::Write;

use super::table::{Row, nanos, text};
use super::{PoseTrajectory, RigidError};

/// Reads a table with commas, semicolons or tabs (the one that the header has most of). The header names, in any order and case, and with
/// anything before them that ends in a dot, slash or underscore:
/// time (`stamp`, `time`, `timestamp`, `t`, or `sec` with `nanosec`/`nsec`), position (`x`, `px`, `tx`, `pos_x`, `position.x` …) and
/// orientation (`qx`, `q_x`, `quat_x`, `orientation.x` …; w as well). Other columns are left alone, but for `frame_id`.
///
/// The unit of time stands in the header (`time [ms]`, `stamp_ns`); elsewhere the first row's size tells: from 1e17 on nanoseconds, from
/// 1e14 microseconds, from 1e11 milliseconds, else seconds. Positions are metres, or millimetres where the header says `[mm]`.
///
/// # Errors
/// [`RigidError::Header`], [`RigidError::Value`], [`RigidError::Order`], [`RigidError::Quaternion`], [`RigidError::Empty`],
/// [`RigidError::Csv`].
pub fn parse_pose_csv(bytes: &[u8], name: &str) -> Result<PoseTrajectory, RigidError> {
    let text = text(bytes, name)?;
    let first = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let count = |delimiter: u8| first.bytes().filter(|byte| *byte == delimiter).count();
    let delimiter = *[b',', b';', b'\t'].iter().rev().max_by_key(|delimiter| count(**delimiter)).unwrap_or(&b',');
    let mut reader = csv::ReaderBuilder::new().delimiter(delimiter).flexible(true).trim(csv::Trim::All).from_reader(text.as_bytes());
    let csv_error = |source| RigidError::Csv { name: name.to_owned(), source };
    let header: Vec<String> = reader.headers().map_err(csv_error)?.iter().map(str::to_owned).collect();
    let columns = Columns::of(&header, name)?;
    let mut trajectory = PoseTrajectory::default();
    let mut digits = columns.digits;
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(csv_error)? {
        let line = record.position().map_or(0, |position| position.line() as usize);
        let row = Row { name, line, cells: record.iter().collect() };
        let stamp = columns.stamp(&row, &mut digits)?;
        row.check_order(stamp, trajectory.stamps.last())?;
        let [x, y, z] = columns.position;
        let position = nalgebra::Vector3::new(row.number(x)?, row.number(y)?, row.number(z)?) * columns.metres;
        if let Some(frame) = columns.frame.filter(|_| trajectory.stamps.is_empty()) {
            trajectory.frame = row.cell(frame)?.to_owned();
        }
        trajectory.push(stamp, position, row.rotation(columns.rotation)?);
    }
    if trajectory.stamps.is_empty() { Err(RigidError::Empty { name: name.to_owned() }) } else { Ok(trajectory) }
}

/// Writes a table with commas: the inverse of [`parse_pose_csv`].
pub fn write_pose_csv(trajectory: &PoseTrajectory) -> String {
    let framed = !trajectory.frame.is_empty();
    let mut content = format!("stamp_ns,x,y,z,qx,qy,qz,qw{}\n", if framed { ",frame_id" } else { "" });
    let frame = if framed { format!(",\"{}\"", trajectory.frame.replace('"', "\"\"")) } else { String::new() };
    for ((stamp, p), q) in trajectory.stamps.iter().zip(&trajectory.positions).zip(&trajectory.rotations) {
        let _ = writeln!(content, "{},{},{},{},{},{},{},{}{frame}", stamp.nanos, p.x, p.y, p.z, q.i, q.j, q.k, q.w);
    }
    content
}

/// Which column is what.
struct Columns {
    time: usize,
    /// Whole nanoseconds beside whole seconds.
    nanoseconds: Option<usize>,
    /// The time's unit is 10^-digits s; `None` until the first row tells.
    digits: Option<i32>,
    position: [usize; 3],
    /// x, y, z, w.
    rotation: [usize; 4],
    frame: Option<usize>,
    metres: f64,
}

/// A header's cell: its words in lower case, joined by `_`, and the unit in brackets.
struct Title {
    words: String,
    unit: String,
}

impl Title {
    fn of(cell: &str) -> Self {
        let (title, unit) = cell.split_once(['[', '(']).unwrap_or((cell, ""));
        let lower = title.trim().trim_start_matches(['#', '%']).to_lowercase();
        let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        Self { words: words.join("_"), unit: unit.trim_end_matches([']', ')', ' ']).trim().to_lowercase() }
    }

    /// The words end with this name.
    fn is(&self, name: &str) -> bool {
        self.words.strip_suffix(name).is_some_and(|before| before.is_empty() || before.ends_with('_'))
    }
}

impl Columns {
    fn of(header: &[String], name: &str) -> Result<Self, RigidError> {
        let titles: Vec<Title> = header.iter().map(|cell| Title::of(cell)).collect();
        let find = |names: &[String]| names.iter().find_map(|name| titles.iter().position(|title| title.is(name)));
        let need = |names: &[String], missing: &str| {
            let absent = || RigidError::Header { name: name.to_owned(), line: 1, missing: missing.to_owned(), found: header.to_vec() };
            find(names).ok_or_else(absent)
        };
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let nanoseconds = find(&owned(&["nanosec", "nanosecs", "nsec", "nsecs"]));
        let seconds = find(&owned(&["sec", "secs"])).filter(|_| nanoseconds.is_some());
        let units = [("s", 0), ("sec", 0), ("ms", 3), ("us", 6), ("ns", 9)];
        let time_names = ["stamp", "timestamp", "time", "t"];
        let with_unit = time_names.iter().flat_map(|name| units.map(|(unit, _)| format!("{name}_{unit}")));
        let time = match seconds {
            Some(seconds) => seconds,
            None => need(&owned(&time_names).into_iter().chain(with_unit).collect::<Vec<_>>(), "time (stamp, time, timestamp, t)")?,
        };
        let of_unit = |unit: &str| units.iter().find(|(name, _)| *name == unit).map(|(_, digits)| *digits);
        let title = &titles[time];
        let by_name = title.words.rsplit_once('_').filter(|(before, _)| time_names.iter().any(|name| before.ends_with(name)));
        let digits = if seconds.is_some() { Some(0) } else { of_unit(&title.unit).or_else(|| of_unit(by_name?.1)) };
        let axis = |axis: &str| {
            let names = [format!("position_{axis}"), format!("pos_{axis}"), format!("p_{axis}"), format!("translation_{axis}")];
            need(&[&names[..], &[format!("p{axis}"), format!("t{axis}"), axis.to_owned()]].concat(), &format!("position {axis}"))
        };
        let position = [axis("x")?, axis("y")?, axis("z")?];
        let part = |part: &str| {
            let names = ["orientation", "rotation", "quaternion", "quat", "q"].map(|name| format!("{name}_{part}"));
            need(&[&names[..], &[format!("q{part}")]].concat(), &format!("orientation {part} (q{part})"))
        };
        let rotation = [part("x")?, part("y")?, part("z")?, part("w")?];
        let metres = if position.iter().all(|column| titles[*column].unit == "mm") { 1e-3 } else { 1.0 };
        Ok(Self {
            time,
            nanoseconds: nanoseconds.filter(|_| seconds.is_some()),
            digits,
            position,
            rotation,
            frame: find(&owned(&["frame_id"])),
            metres,
        })
    }

    fn stamp(&self, row: &Row<'_>, digits: &mut Option<i32>) -> Result<cromosim_spatial::Stamp, RigidError> {
        let unit = match *digits {
            Some(unit) => unit,
            None => *digits.insert(match row.number_of_time(self.time)?.abs() {
                1e17.. => 9,
                1e14.. => 6,
                1e11.. => 3,
                _ => 0,
            }),
        };
        let stamp = row.stamp(self.time, unit)?;
        let Some(column) = self.nanoseconds else { return Ok(stamp) };
        let more = nanos(row.cell(column)?, 9).filter(|nanos| (0..1_000_000_000).contains(nanos));
        let more = more.ok_or_else(|| row.error(column, "nanoseconds below 1e9"))?;
        let sum = stamp.nanos.checked_add(more).ok_or_else(|| row.error(column, "a time"))?;
        Ok(cromosim_spatial::Stamp::from_nanos(sum))
    }
}

impl Row<'_> {
    /// Times are larger than any other number.
    fn number_of_time(&self, column: usize) -> Result<f64, RigidError> {
        let number = self.cell(column)?.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.error(column, "a time"))
    }
}
