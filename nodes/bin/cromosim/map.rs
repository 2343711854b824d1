//! `cromosim map`: fits what simulated IMUs' distributions lack to those of real ones.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use cromosim_bag::BagReader;
use cromosim_imu::Reading;
use cromosim_learned::{MappingFile, PlacementMapping};
use cromosim_msgs::RosMessage;
use cromosim_msgs::sensor_msgs::Imu;

/// Fit a distribution mapping (by ranks, per channel and placement) from a simulated to a measured
/// recording
#[derive(Args)]
pub struct Arguments {
    /// The recording with the simulated IMUs
    #[arg(long, value_name = "RECORDING")]
    simulated: PathBuf,
    /// The recording with the real IMUs; need be neither the same motion nor as long
    #[arg(long, value_name = "RECORDING")]
    measured: PathBuf,
    /// The file to write (YAML), for `simulate --mapping` and virtual_imu's parameter `mapping`
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace FILE where it exists
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let out = arguments.out.display();
    if arguments.out.exists() && !arguments.force {
        bail!("{out}: exists already; give another name, or --force to replace it");
    }
    let (simulated, measured) = (
        readings(&arguments.simulated)?,
        readings(&arguments.measured)?,
    );
    let names: BTreeSet<&String> = simulated
        .keys()
        .filter(|name| measured.contains_key(*name))
        .collect();
    if names.is_empty() {
        let list = |readings: &BTreeMap<String, Vec<Reading>>| {
            readings.keys().cloned().collect::<Vec<_>>().join(", ")
        };
        bail!(
            "no placement is in both recordings: {} has {}; {} has {}",
            arguments.simulated.display(),
            list(&simulated),
            arguments.measured.display(),
            list(&measured)
        );
    }
    let mut file = MappingFile::default();
    for name in names {
        file.placements.insert(
            name.clone(),
            PlacementMapping::fit(&simulated[name], &measured[name], name)?,
        );
    }
    file.write(&arguments.out)?;
    println!(
        "{out}: {}",
        file.placements
            .keys()
            .cloned()
            .collect::<Vec<_>>()
            .join(", ")
    );
    Ok(())
}

/// Readings of every /imu/NAME/data_raw.
fn readings(path: &Path) -> anyhow::Result<BTreeMap<String, Vec<Reading>>> {
    let bag = BagReader::open(path)?;
    let topics = bag
        .summary()
        .topics
        .iter()
        .filter(|counted| counted.topic.type_name == Imu::TYPE_NAME);
    let names: Vec<String> = topics
        .filter_map(|counted| {
            Some(
                counted
                    .topic
                    .name
                    .strip_prefix("/imu/")?
                    .strip_suffix("/data_raw")?
                    .to_owned(),
            )
        })
        .collect();
    if names.is_empty() {
        bail!(
            "{}: no topic /imu/NAME/data_raw of sensor_msgs/msg/Imu",
            path.display()
        );
    }
    let read = |name: String| -> anyhow::Result<(String, Vec<Reading>)> {
        let messages = bag
            .read::<Imu>(&format!("/imu/{name}/data_raw"))?
            .into_iter();
        let readings = messages.map(|(_, imu)| Reading {
            specific_force: imu.linear_acceleration.into(),
            angular_velocity: imu.angular_velocity.into(),
        });
        Ok((name, readings.collect()))
    };
    names.into_iter().map(read).collect()
}
