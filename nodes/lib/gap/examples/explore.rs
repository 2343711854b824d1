//! `cromosim diagnose`: where the gap between simulated and real lies, which effects cause it, how far it shrinks.

use std::path::PathBuf;

use anyhow::bail;

use cromosim_bag::BagReader;
use cromosim_gap::{DiagnoseOptions, ImuSeries, PlacementRecord, PoseSeries};
use cromosim_imu::{EffectKind, Reading};
use cromosim_msgs::RosMessage;
use cromosim_msgs::geometry_msgs::PoseStamped;
use cromosim_msgs::sensor_msgs::Imu;
use cromosim_spatial::Stamp;
use nalgebra::Vector3;

/// Names the causes of the gap between a recording's real IMUs and their simulation.
#[derive(clap::Parser, Debug)]
struct Arguments {
    /// Recording with /reference/NAME (or SMPL states and placements) and /imu/NAME/data_raw.
    recording: PathBuf,
    /// Takes an effect out of the library.
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
}

fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let reader = BagReader::open(&arguments.recording)?;
    let mut without = Vec::new();
    for name in &arguments.without {
        let Some(kind) = EffectKind::from_name(name) else { bail!("--without {name}: no such effect") };
        without.push(kind);
    }
    let options = DiagnoseOptions { without, seed: 0 };
    for record in read(&reader)? {
        let begin = std::time::Instant::now();
        match cromosim_gap::diagnose(&record, &options) {
            Ok(answer) => {
                println!(
                    "{}",
                    serde_json::to_string(
                        &serde_json::json!({"placement": record.name, "seconds": begin.elapsed().as_secs_f64(), "diagnosis": answer.diagnosis})
                    )?
                );
            }
            Err(error) => eprintln!("ERROR {error}"),
        }
    }
    Ok(())
}

/// Every placement that has a reference and an IMU.
fn read(reader: &BagReader) -> anyhow::Result<Vec<PlacementRecord>> {
    let names = |prefix: &str, suffix: &str, type_name: &str| -> Vec<String> {
        let topics = reader.summary().topics.iter().filter(|counted| counted.topic.type_name == type_name);
        topics.filter_map(|counted| Some(counted.topic.name.strip_prefix(prefix)?.strip_suffix(suffix)?.to_owned())).collect()
    };
    let mut references = names("/reference/", "", PoseStamped::TYPE_NAME);
    references.sort();
    references.into_iter().map(|name| record(reader, &name)).collect()
}

fn record(reader: &BagReader, name: &str) -> anyhow::Result<PlacementRecord> {
    let mut reference = PoseSeries::default();
    for (_, message) in reader.read::<PoseStamped>(&format!("/reference/{name}"))? {
        let pose: nalgebra::Isometry3<f64> = message.pose.try_into()?;
        reference.stamps.push(Stamp::from_nanos(message.header.stamp.nanos()));
        reference.positions.push(pose.translation.vector);
        reference.rotations.push(pose.rotation);
    }
    let mut imu = ImuSeries::default();
    for (number, (_, message)) in reader.read::<Imu>(&format!("/imu/{name}/data_raw"))?.into_iter().enumerate() {
        let vector = |v: &cromosim_msgs::geometry_msgs::Vector3| Vector3::new(v.x, v.y, v.z);
        if number == 0 {
            let declared = |c: &[f64; 9]| Some(((c[0] + c[4] + c[8]) / 3.0).sqrt()).filter(|sigma| *sigma > 0.0);
            imu.declared = [declared(&message.linear_acceleration_covariance), declared(&message.angular_velocity_covariance)];
        }
        imu.stamps.push(Stamp::from_nanos(message.header.stamp.nanos()));
        imu.readings.push(Reading { force: vector(&message.linear_acceleration), rate: vector(&message.angular_velocity) });
    }
    Ok(PlacementRecord { name: name.to_owned(), reference, imu })
}

fn main() -> anyhow::Result<()> {
    run(&clap::Parser::parse())
}
