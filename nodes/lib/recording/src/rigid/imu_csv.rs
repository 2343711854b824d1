//! Tables of IMU readings with a header that names the columns: what `sensor_msgs/Imu` becomes in a
//! spreadsheet.

use std::fmt::Write;

use super::header::{TimeColumn, Title, line_of, need, table_reader};
use super::table::{Row, text};
use super::{ImuSeries, RigidError};

const HEADER: &str = "stamp_ns,angular_velocity_x,angular_velocity_y,angular_velocity_z,linear_acceleration_x,linear_acceleration_y,linear_acceleration_z";
/// What the columns of angular velocity and of specific force are called, before the axis.
pub(super) const RATES: [&str; 6] = [
    "angular_velocity",
    "gyroscope",
    "gyro",
    "gyr",
    "angular_rate",
    "w",
];
pub(super) const FORCES: [&str; 8] = [
    "linear_acceleration",
    "specific_force",
    "accelerometer",
    "acceleration",
    "accel",
    "acc",
    "f",
    "a",
];

/// Reads a table with commas, semicolons or tabs. The header names, in any order and case, and with
/// anything before them that ends in a dot, slash or underscore: time, as in
/// [`super::parse_pose_csv`]; angular velocity in rad/s (`angular_velocity_x`, `gyro_x`, `gyr.x`,
/// `w_x` and so on); specific force in m/s2, +g up at rest (`linear_acceleration_x`, `accel_x`,
/// `acc.x`, `f_x`, `a_x` and so on). Other columns are left alone.
///
/// # Errors
/// [`RigidError::Header`], [`RigidError::Value`], [`RigidError::Order`], [`RigidError::Empty`],
/// [`RigidError::Csv`].
pub fn parse_imu_csv(bytes: &[u8], name: &str) -> Result<ImuSeries, RigidError> {
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
    let titles: Vec<Title> = header.iter().map(|cell| Title::of(cell)).collect();
    let time = TimeColumn::of(&titles, &header, name)?;
    let axes = |names: &[&str], missing: &str| {
        let axis = |axis: &str| {
            let names: Vec<String> = names.iter().map(|name| format!("{name}_{axis}")).collect();
            need(&titles, &names, &format!("{missing} {axis}"), &header, name)
        };
        Ok::<_, RigidError>([axis("x")?, axis("y")?, axis("z")?])
    };
    let (rates, forces) = (
        axes(&RATES, "angular velocity (gyro)")?,
        axes(&FORCES, "specific force (accel)")?,
    );
    let mut series = ImuSeries::default();
    let mut digits = time.digits;
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(csv_error)? {
        let row = Row {
            name,
            line: line_of(&record, text),
            cells: record.iter().collect(),
        };
        let stamp = time.stamp(&row, &mut digits)?;
        row.check_order(stamp, series.stamps.last())?;
        let vector = |[x, y, z]: [usize; 3]| {
            Ok::<_, RigidError>(nalgebra::Vector3::new(
                row.number(x)?,
                row.number(y)?,
                row.number(z)?,
            ))
        };
        series.push(stamp, vector(forces)?, vector(rates)?);
    }
    if series.stamps.is_empty() {
        Err(RigidError::Empty {
            name: name.to_owned(),
        })
    } else {
        Ok(series)
    }
}

/// Writes a table with commas: the inverse of [`parse_imu_csv`].
pub fn write_imu_csv(series: &ImuSeries) -> String {
    let mut content = format!("{HEADER}\n");
    for ((stamp, f), w) in series
        .stamps
        .iter()
        .zip(&series.specific_force)
        .zip(&series.angular_velocity)
    {
        let _ = writeln!(
            content,
            "{},{},{},{},{},{},{}",
            stamp.nanos, w.x, w.y, w.z, f.x, f.y, f.z
        );
    }
    content
}
