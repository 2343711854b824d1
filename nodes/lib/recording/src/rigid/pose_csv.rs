//! Tables of poses with a header that names the columns: what `geometry_msgs/PoseStamped` becomes
//! in a spreadsheet.

use std::fmt::Write;

use super::header::{TimeColumn, Title, find, line_of, need, table_reader};
use super::table::{Row, text};
use super::{PoseTrajectory, RigidError};

/// Reads a table with commas, semicolons or tabs (the one that the header has most of). The header
/// names, in any order and case, and with anything before them that ends in a dot, slash or
/// underscore: time (`stamp`, `time`, `timestamp`, `t`, or `sec` with `nanosec`/`nsec`), position
/// (`x`, `px`, `tx`, `pos_x`, `position.x` …) and orientation (`qx`, `q_x`, `quat_x`,
/// `orientation.x` …; w as well). Other columns are left alone, but for `frame_id`.
///
/// The unit of time stands in the header (`time [ms]`, `stamp_ns`); elsewhere the first row's size
/// tells: from 1e17 on nanoseconds, from 1e14 microseconds, from 1e11 milliseconds, else seconds.
/// Positions are metres, or millimetres where the header says `[mm]`.
///
/// # Errors
/// [`RigidError::Header`], [`RigidError::Value`], [`RigidError::Order`],
/// [`RigidError::Quaternion`], [`RigidError::Empty`], [`RigidError::Csv`].
pub fn parse_pose_csv(bytes: &[u8], name: &str) -> Result<PoseTrajectory, RigidError> {
    let text = text(bytes, name)?;
    let mut reader = table_reader(text);
    let csv_error = |source| RigidError::Csv {
        name: name.to_owned(),
        source,
    };
    let header: Vec<String> = reader
        .headers()
        .map_err(csv_error)?
        .iter()
        .map(str::to_owned)
        .collect();
    let columns = Columns::of(&header, name)?;
    let mut trajectory = PoseTrajectory::default();
    let mut digits = columns.time.digits;
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(csv_error)? {
        let row = Row {
            name,
            line: line_of(&record, text),
            cells: record.iter().collect(),
        };
        let stamp = columns.time.stamp(&row, &mut digits)?;
        row.check_order(stamp, trajectory.stamps.last())?;
        let [x, y, z] = columns.position;
        let position =
            nalgebra::Vector3::new(row.number(x)?, row.number(y)?, row.number(z)?) * columns.metres;
        if let Some(frame) = columns.frame.filter(|_| trajectory.stamps.is_empty()) {
            trajectory.frame = row.cell(frame)?.to_owned();
        }
        trajectory.push(stamp, position, row.rotation(columns.rotation)?);
    }
    if trajectory.stamps.is_empty() {
        Err(RigidError::Empty {
            name: name.to_owned(),
        })
    } else {
        Ok(trajectory)
    }
}

/// Writes a table with commas: the inverse of [`parse_pose_csv`].
pub fn write_pose_csv(trajectory: &PoseTrajectory) -> String {
    let framed = !trajectory.frame.is_empty();
    let mut content = format!(
        "stamp_ns,x,y,z,qx,qy,qz,qw{}\n",
        if framed { ",frame_id" } else { "" }
    );
    let frame = if framed {
        format!(",\"{}\"", trajectory.frame.replace('"', "\"\""))
    } else {
        String::new()
    };
    for ((stamp, p), q) in trajectory
        .stamps
        .iter()
        .zip(&trajectory.positions)
        .zip(&trajectory.rotations)
    {
        let _ = writeln!(
            content,
            "{},{},{},{},{},{},{},{}{frame}",
            stamp.nanos, p.x, p.y, p.z, q.i, q.j, q.k, q.w
        );
    }
    content
}

/// Which column is what.
struct Columns {
    time: TimeColumn,
    position: [usize; 3],
    /// x, y, z, w.
    rotation: [usize; 4],
    frame: Option<usize>,
    metres: f64,
}

impl Columns {
    fn of(header: &[String], name: &str) -> Result<Self, RigidError> {
        let titles: Vec<Title> = header.iter().map(|cell| Title::of(cell)).collect();
        let need = |names: &[String], missing: &str| need(&titles, names, missing, header, name);
        let time = TimeColumn::of(&titles, header, name)?;
        let axis = |axis: &str| {
            let names = [
                format!("position_{axis}"),
                format!("pos_{axis}"),
                format!("p_{axis}"),
                format!("translation_{axis}"),
            ];
            need(
                &[
                    &names[..],
                    &[format!("p{axis}"), format!("t{axis}"), axis.to_owned()],
                ]
                .concat(),
                &format!("position {axis}"),
            )
        };
        let position = [axis("x")?, axis("y")?, axis("z")?];
        let part = |part: &str| {
            let names = ["orientation", "rotation", "quaternion", "quat", "q"]
                .map(|name| format!("{name}_{part}"));
            need(
                &[&names[..], &[format!("q{part}")]].concat(),
                &format!("orientation {part} (q{part})"),
            )
        };
        let rotation = [part("x")?, part("y")?, part("z")?, part("w")?];
        let metres = if position.iter().all(|column| titles[*column].unit == "mm") {
            1e-3
        } else {
            1.0
        };
        Ok(Self {
            time,
            position,
            rotation,
            frame: find(&titles, &["frame_id".to_owned()]),
            metres,
        })
    }
}
