//! Movella DOT's CSV exports and MT Manager's text exports (MTw, MTi), one IMU a file.
//!
//! Lines of what the device is (`DeviceTag:`, `OutputRate:`; MT Manager's begin with `//`), then a
//! header from `PacketCounter` on, then a row a sample. Acc in m/s2; Gyr in degrees a second from
//! DOTs, in radians a second from MT Manager, which is told by its `//` and by quaternions called
//! `q0` to `q3`. SampleTimeFine counts microseconds (DOT) or tenths of milliseconds, as 32 bits
//! that begin again at 0; PacketCounter 16 bits or more. Where Acc and Gyr are missing, the
//! increments of velocity and orientation (`dv`, `dq`; `VelInc`, `OriInc`) by the rate are the
//! same; else `FreeAcc`, whose gravity is taken out, by an orientation. The orientation is that of
//! the sensor in a world whose z axis is up. Magnetic fields are in units of their own, and left
//! alone.

mod about;
mod clock;
mod columns;

use about::{About, DEVICE_TIME, header, plain};
use columns::Columns;
use cromosim_spatial::Stamp;

use super::capture::{content, placement_name};
use super::{DatasetRecording, PlacedImu};
use crate::rigid::table::{Row, text};
use crate::rigid::{ImuSeries, RigidError, median_rate};

/// Whether such a file's header is among the first lines: with the device's time, or below lines of
/// what the device is. A table of packets with a time of its own is anybody's.
pub(super) fn is_movella(start: &str) -> bool {
    header(start).is_some_and(|(index, delimiter)| {
        let line = start.lines().nth(index).unwrap_or_default();
        index > 0 || line.split(delimiter).any(|cell| plain(cell) == DEVICE_TIME)
    })
}

/// The rows with anything in them, from the line `skipped` (0-based) on.
fn rows<'a>(text: &'a str, name: &'a str, skipped: usize, delimiter: char) -> Vec<Row<'a>> {
    let lines = text.lines().enumerate().skip(skipped);
    let lines = lines.filter(|(_, line)| !line.trim().is_empty());
    lines
        .map(|(index, line)| Row {
            name,
            line: index + 1,
            cells: line.split(delimiter).map(str::trim).collect(),
        })
        .collect()
}

/// Reads the readings, and the orientation where the file has one, as a recording of one IMU, which
/// is called as the device's tag says, or `body`. Stamps are the device's own time, or where it has
/// none count from the first packet.
///
/// # Errors
/// [`RigidError::Header`], [`RigidError::Content`], [`RigidError::Value`],
/// [`RigidError::Quaternion`], [`RigidError::Empty`].
pub fn parse_movella(bytes: &[u8], name: &str) -> Result<DatasetRecording, RigidError> {
    let text = text(bytes, name)?;
    let (index, delimiter) = header(text).ok_or_else(|| {
        content(
            name,
            "header",
            "no line with PacketCounter among its columns",
        )
    })?;
    let file = About::of(text, index, delimiter);
    let rows = rows(text, name, index + 1, delimiter);
    let Some(first) = rows.first() else {
        return Err(RigidError::Empty {
            name: name.to_owned(),
        });
    };
    let columns = Columns::of(&file, first, (name, index + 1))?;
    let stamps = clock::stamps(&rows, &file)?;
    let known: Vec<Stamp> = stamps.iter().copied().flatten().collect();
    let rate_hz = file.rate_hz.or_else(|| median_rate(&known)).unwrap_or(0.0);
    if rate_hz == 0.0 && columns.needs_rate() {
        let problem = "increments of velocity or orientation need a rate, and nothing says it; export with OutputRate or SampleTimeFine";
        return Err(content(name, "header", problem));
    }
    let mut imu = PlacedImu {
        placement: placement_name(file.tag.unwrap_or("body")),
        ..PlacedImu::default()
    };
    for (row, stamp) in rows.iter().zip(stamps) {
        let (Some(stamp), Some(reading)) = (stamp, columns.reading(row, rate_hz)?) else {
            imu.rows_left_out += 1;
            continue;
        };
        let ImuSeries { stamps, .. } = &mut imu.series;
        if stamps.last().is_some_and(|last| stamp <= *last) {
            imu.rows_left_out += 1;
            continue;
        }
        imu.series
            .push(stamp, reading.specific_force, reading.angular_velocity);
        imu.world_from_sensor.extend(reading.world_from_sensor);
    }
    if imu.series.stamps.is_empty() {
        return Err(RigidError::Empty {
            name: name.to_owned(),
        });
    }
    Ok(DatasetRecording {
        name: name.to_owned(),
        rate_hz,
        imus: vec![imu],
        notes: columns.notes(&file),
        ..DatasetRecording::default()
    })
}
