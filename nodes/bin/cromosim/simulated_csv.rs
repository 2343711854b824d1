//! One placement's readings as a table: time in s, units in the header.

use std::path::Path;

use anyhow::{Context, bail};
use cromosim_bag::BagReader;
use cromosim_msgs::sensor_msgs::{Imu, MagneticField};
use cromosim_recording::{PlayedPerson, write_file_with};

use crate::simulate_setup::{Setup, names};

/// Columns; `cromosim convert` and everything that takes an IMU series reads them.
const HEADER: &str = "time [s],specific_force_x [m/s2],specific_force_y [m/s2],specific_force_z [m/s2],\
    angular_velocity_x [rad/s],angular_velocity_y [rad/s],angular_velocity_z [rad/s]";

/// Of devices with a magnetometer, in a known field.
const MAGNETIC: &str = ",magnetic_field_x [T],magnetic_field_y [T],magnetic_field_z [T]";

/// The only person and the only placement's name.
///
/// # Errors
/// There are several.
pub fn the_only<'a>(
    setup: &'a Setup,
    people: &'a [PlayedPerson],
    out: &Path,
) -> anyhow::Result<(&'a PlayedPerson, &'a str)> {
    match (people, names(setup.simulation.placements()).as_slice()) {
        ([person], [placement]) => Ok((person, placement)),
        ([_], placements) => bail!(
            "{}: a table holds one placement, of {}; choose with --placement NAME=SITE, or give a bag and --csv DIR for a table of each",
            out.display(),
            placements.join(", ")
        ),
        (people, _) => bail!(
            "{}: a table holds one person, of {}; choose with --person, or give a bag and --csv DIR for a table of each",
            out.display(),
            people.len()
        ),
    }
}

/// Writes the messages of a bag (`TOPIC/data`, and `TOPIC/mag` where it is) as a table; gives the number
/// of its rows.
pub fn write_table(bag: &Path, topic: &str, out: &Path, force: bool) -> anyhow::Result<u64> {
    let reader = BagReader::open(bag)?;
    let messages = reader.read::<Imu>(&format!("{topic}/data"))?;
    let magnetic_topic = format!("{topic}/mag");
    let has_field = reader.topic(&magnetic_topic).is_ok();
    let fields = match has_field {
        true => reader.read::<MagneticField>(&magnetic_topic)?,
        false => Vec::new(),
    };
    write_file_with(out, force, |file| {
        let mut write = || -> std::io::Result<()> {
            writeln!(file, "{HEADER}{}", if has_field { MAGNETIC } else { "" })?;
            let mut fields = fields.iter();
            for (_, message) in &messages {
                let stamp = &message.header.stamp;
                let (f, w) = (&message.linear_acceleration, &message.angular_velocity);
                write!(
                    file,
                    "{}.{:09},{},{},{},{},{},{}",
                    stamp.sec, stamp.nanosec, f.x, f.y, f.z, w.x, w.y, w.z
                )?;
                // One each reading, in the same order.
                if let Some((_, field)) = fields.next() {
                    let m = &field.magnetic_field;
                    write!(file, ",{},{},{}", m.x, m.y, m.z)?;
                }
                writeln!(file)?;
            }
            Ok(())
        };
        write().with_context(|| format!("{}: cannot be written", out.display()))
    })?;
    Ok(messages.len() as u64)
}
