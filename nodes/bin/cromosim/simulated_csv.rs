//! One placement's readings as a table: time in s, units in the header.

use std::path::Path;

use anyhow::{Context, bail};
use cromosim_bag::BagReader;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_recording::{PlayedPerson, write_file_with};

use crate::simulate_setup::{Setup, names};

/// Columns; `cromosim convert` and everything that takes an IMU series reads them.
const HEADER: &str = "time [s],specific_force_x [m/s2],specific_force_y [m/s2],specific_force_z [m/s2],\
    angular_velocity_x [rad/s],angular_velocity_y [rad/s],angular_velocity_z [rad/s]";

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

/// Writes the messages of a bag as a table; gives the number of its rows.
pub fn write_table(bag: &Path, topic: &str, out: &Path, force: bool) -> anyhow::Result<u64> {
    let messages = BagReader::open(bag)?.read::<Imu>(topic)?;
    write_file_with(out, force, |file| {
        let mut write = || -> std::io::Result<()> {
            writeln!(file, "{HEADER}")?;
            for (_, message) in &messages {
                let stamp = &message.header.stamp;
                let (f, w) = (&message.linear_acceleration, &message.angular_velocity);
                writeln!(
                    file,
                    "{}.{:09},{},{},{},{},{},{}",
                    stamp.sec, stamp.nanosec, f.x, f.y, f.z, w.x, w.y, w.z
                )?;
            }
            Ok(())
        };
        write().with_context(|| format!("{}: cannot be written", out.display()))
    })?;
    Ok(messages.len() as u64)
}
